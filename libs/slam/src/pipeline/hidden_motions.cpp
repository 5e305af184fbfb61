#include "pipeline/hidden_motions.hpp"

#include "gelslam/registration/registration.hpp"

namespace gelslam::slam::detail {

void HiddenMotions::pass(int trial, double time_s, const std::array<bool, 6>& observable) {
  if (trial != trial_) {
    trial_ = trial;
    observable_.fill(true);
    agreed_s_.fill(time_s);
  }
  for (std::size_t axis = 0; axis < observable.size(); ++axis) {
    if (observable[axis] != observable_[axis] && time_s - agreed_s_[axis] >= kLasting_s)
      observable_[axis] = observable[axis];
    if (observable[axis] == observable_[axis]) agreed_s_[axis] = time_s;
  }
}

std::string HiddenMotions::words() const { return trial_ < 0 ? "" : describe_observability(observable_); }

}  // namespace gelslam::slam::detail
