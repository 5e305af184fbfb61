#pragma once

#include <array>
#include <string>

namespace gelslam::slam::detail {

/// Motions that the surface does not show, as a person can follow them: a change counts once it has lasted,
/// since single frames come and go at 25 Hz.
class HiddenMotions {
 public:
  /// Of a tracked frame; times do not go back.
  void pass(int trial, double time_s, const std::array<bool, 6>& observable);

  /// describe_observability() of what has lasted; "" at the start of a trial.
  std::string words() const;

 private:
  static constexpr double kLasting_s = 0.5;

  int trial_ = -1;
  std::array<bool, 6> observable_{};  ///< as said
  std::array<double, 6> agreed_s_{};  ///< when a frame last was as said
};

}  // namespace gelslam::slam::detail
