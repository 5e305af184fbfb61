#pragma once

#include <pybind11/numpy.h>

#include <optional>

#include "gelslam/slam/frame_report.hpp"

namespace gelslam::python {

namespace py = pybind11;

/// A frame that a program may keep for long: without its surface, and with keyframes that are numbers alone.
FrameReport without_surfaces(FrameReport report);

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
