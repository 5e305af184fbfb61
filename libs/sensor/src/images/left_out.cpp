#include "images/left_out.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::detail {

void LeftOut::leave_out(const std::string& damage) {
  constexpr int patience = 10;
  if (left_out_++ == 0) first_ = damage;
  if (used_ == 0 && left_out_ == patience) throw Error(first_);
}

void LeftOut::require_some(const std::string& what) const {
  if (used_ > 0) return;
  throw Error(left_out_ > 0 ? first_ : what + " holds no readable frame");
}

std::string LeftOut::warning() const {
  if (left_out_ == 0) return "";
  return "left out " + counted(left_out_, "damaged picture") + " (the first: " + first_ + ")";
}

}  // namespace gelslam::detail
