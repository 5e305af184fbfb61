#pragma once

#include <array>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

/// How far the poses of a finished map may be off, of the frames whose keyframe is placed in it. What was not
/// observable for a while (UnobservableMotions), by motion.
RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames, const MapSnapshot& map);

/// "poses may be off by 1.6 mm and 6 degrees: return to where you began" where the drift is large
/// (kLargeDriftMm) and the sensor was farther from the map's origin (`farthest_mm`) than that, else what was
/// not observable: "twisting is not observable in 10 frames, from 0.4 s on: press on texture". At most one
/// sentence.
std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty, double farthest_mm);

/// One standard deviation of each, the translation first.
Vector6d sigma_of(const Matrix6d& rotation_first);

/// Two standard deviations of a pose from which on drift is reported.
inline constexpr double kLargeDriftMm = 1.0, kLargeDriftDeg = 5.0;

/// "may be off by 1.6 mm along x, 6 degrees about y": where the drift is large; else "". Translation first.
std::string describe_drift(const Vector6d& sigma);

/// Motions that are not observable: a change counts once it has lasted. Counted in frames, so that a log says
/// the same at any rate.
class UnobservableMotions {
 public:
  void pass(const FrameRecord& frame);  ///< that has a keyframe

  /// describe_observability() of what has lasted; "" at the start of a trial.
  std::string words() const;
  /// Stretches that have lasted, by motion.
  std::vector<RunReport::UnobservableMotion> all() const;

 private:
  static constexpr int kLastingFrames = 12;  // half a second at 25 Hz
  struct Motion {
    bool is_observable = true;
    int differing = 0;  ///< frames since one agreed with it
    RunReport::UnobservableMotion waiting{}, counted{};
  };

  int trial_ = -1;
  std::array<Motion, 6> motions_;
};

}  // namespace gelslam
