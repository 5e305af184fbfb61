#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/core/trajectory.hpp"

namespace gelslam::python {

namespace py = pybind11;

/// An image given by the user. `bgr` shares the array's memory if its rows are contiguous.
struct Picture {
  py::array owner;
  cv::Mat3b bgr;
};

/// Converts an array. Throws TypeError if it is not an array of uint8, and Error for a shape other than
/// height x width x 3. `name` stands for the argument in messages.
Picture picture_of(const py::object& array, const std::string& name);

/// `__reduce_ex__` for classes whose state can be pickled, for every protocol. pybind11 crashes the
/// interpreter with protocols 0 and 1.
inline py::tuple reduced(const py::object& self, int /*protocol*/) {
  return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(py::type::of(self)),
                        self.attr("__getstate__")());
}

/// `__setstate__` of a class: throws Error for an invalid state.
template <typename Make>
auto unpickler(const char* name, Make make) {
  return [=](const py::tuple& state) {
    try {
      return make(state);
    } catch (const py::cast_error&) {
    } catch (const py::error_already_set&) {
    }
    throw Error(std::string("this is no pickled gelslam.") + name);
  };
}

/// Returns a new array that shares the image's memory.
py::array array_of(const cv::Mat3b& bgr);

/// Returns a read-only array over memory that `owner` keeps alive. Strides are in bytes.
py::array view(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
               const void* data, const py::handle& owner);
/// The same for contiguous rows of `columns` numbers.
template <class Number>
py::array rows_view(const Number* data, std::size_t rows, int columns, const py::handle& owner) {
  const auto step = static_cast<py::ssize_t>(sizeof(Number));
  return view(py::dtype::of<Number>(), {static_cast<py::ssize_t>(rows), columns}, {columns * step, step},
              data, owner);
}

/// Returns a 4x4 matrix with the translation in meters.
py::array_t<double> array_of(const Pose& pose_mm);
/// Converts a 4x4 matrix in meters. Throws TypeError or Error if it is no rigid motion. `name` stands for the
/// argument in messages.
Pose pose_of(const py::object& array, const std::string& name);

/// Return the poses (Nx4x4) and times (N) of a trajectory.
py::array_t<double> poses_of(const std::vector<StampedPose>& trajectory);
py::array_t<double> times_of(const std::vector<StampedPose>& trajectory);

/// Converts a covariance in rad and mm with rotation first to meters and rad with translation first, as in
/// the stream and in ROS. For information matrices, pass 1 / `per_mm`.
inline constexpr double kMetersPerMm = 1e-3;
py::array_t<double> scaled_array_of(const Matrix6d& rotation_first, double per_mm);

}  // namespace gelslam::python
