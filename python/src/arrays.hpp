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

/// A picture that a user handed over. `bgr` shares the array's memory where its rows are dense.
struct Picture {
  py::array owner;
  cv::Mat3b bgr;
};

/// Throws TypeError for what is no array of uint8, Error for another shape than height x width x 3. `name`
/// stands for the argument in messages.
Picture picture_of(const py::object& array, const std::string& name);

/// `__reduce_ex__` of what has a state to pickle, for every protocol: pybind11 ends the interpreter with 0
/// and 1.
inline py::tuple reduced(const py::object& self, int /*protocol*/) {
  return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(py::type::of(self)),
                        self.attr("__getstate__")());
}

/// `__setstate__` of a class: throws Error for a state that is none of it.
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

/// A new array that shares the picture's memory.
py::array array_of(const cv::Mat3b& bgr);

/// A read-only array over memory that `owner` keeps alive. Strides in bytes.
py::array view(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
               const void* data, const py::handle& owner);
/// The same over rows of `columns` numbers without gaps.
template <class Number>
py::array rows_view(const Number* data, std::size_t rows, int columns, const py::handle& owner) {
  const auto step = static_cast<py::ssize_t>(sizeof(Number));
  return view(py::dtype::of<Number>(), {static_cast<py::ssize_t>(rows), columns}, {columns * step, step},
              data, owner);
}

/// 4x4, translation in meters.
py::array_t<double> array_of(const Pose& pose_mm);
/// Throws TypeError or Error when it is no 4x4 rigid motion. `name` stands for the argument in messages.
Pose pose_of(const py::object& array, const std::string& name);

/// Nx4x4 and N.
py::array_t<double> poses_of(const std::vector<StampedPose>& trajectory);
py::array_t<double> times_of(const std::vector<StampedPose>& trajectory);

/// Covariances in rad and mm, rotation first, to meters and rad, translation first, as the stream and ROS
/// have them; the same for information matrices with 1 / `per_mm`.
inline constexpr double kMetersPerMm = 1e-3;
py::array_t<double> scaled_array_of(const Matrix6d& rotation_first, double per_mm);

}  // namespace gelslam::python
