#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam::python {

namespace py = pybind11;

/// What is known of a frame right after it was tracked.
struct PythonFrame {
  TrackedFrame tracked;                 ///< without keyframes
  std::optional<Matrix6d> covariance;   ///< of the pose in its trial (TrialMap)
  std::vector<std::int64_t> keyframes;  ///< frames that became one
};

PythonFrame with_covariance(TrackedFrame tracked, TrialMap& map);

/// One standard deviation along and about x, y, z, for Python.
py::array_t<double> sigma_mm_of(const Vector6d& sigma);
py::array_t<double> sigma_rad_of(const Vector6d& sigma);

/// The times of frames grow.
class FrameTimes {
 public:
  /// Throws Error for a time that does not.
  void check(double time_s);
  void begin_after(double time_s) { last_time_s_ = time_s; }

 private:
  std::optional<double> last_time_s_;
};

}  // namespace gelslam::python
