#pragma once

#include <pybind11/numpy.h>

#include <optional>

#include "gelslam/slam/frame_report.hpp"

namespace gelslam::python {

namespace py = pybind11;

/// Returns a report that a program may keep for long: without its surface, and with keyframes that contain
/// only numbers.
FrameReport without_surfaces(FrameReport report);

/// Convert standard deviations along and about x, y, z to arrays.
py::array_t<double> sigma_mm_of(const Vector6d& sigma);
py::array_t<double> sigma_rad_of(const Vector6d& sigma);

/// Checks that the times of frames increase.
class FrameTimes {
 public:
  /// Throws Error for a time that does not increase.
  void check(double time_s);
  void begin_after(double time_s) { last_time_s_ = time_s; }

 private:
  std::optional<double> last_time_s_;
};

}  // namespace gelslam::python
