#include "arrays.hpp"

#include <Eigen/LU>
#include <memory>

#include "gelslam/core/error.hpp"
#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam::python {
namespace {

std::string type_name(const py::handle& object) { return py::str(py::type::of(object).attr("__name__")); }

std::string shape_text(const py::array& array) { return py::str(array.attr("shape")); }

py::array require_array(const py::object& object, const std::string& name) {
  if (!py::isinstance<py::array>(object))
    throw py::type_error(name + ": expected a NumPy array, got " + type_name(object));
  return py::reinterpret_borrow<py::array>(object);
}

}  // namespace

Picture picture_of(const py::object& object, const std::string& name) {
  constexpr py::ssize_t kMaxPixelsPerSide = 16384;
  py::array array = require_array(object, name);
  if (array.dtype().kind() != 'u' || array.itemsize() != 1)
    throw py::type_error(name + ": expected an array of uint8, got " + std::string(py::str(array.dtype())));
  if (array.ndim() != 3 || array.shape(2) != 3)
    throw Error(name + ": expected a color picture, height x width x 3 (BGR), got shape " +
                shape_text(array));
  const py::ssize_t rows = array.shape(0), columns = array.shape(1);
  if (rows < 1 || columns < 1 || rows > kMaxPixelsPerSide || columns > kMaxPixelsPerSide)
    throw Error(name + ": a picture of this size cannot be used: shape " + shape_text(array));
  const bool dense_rows = array.strides(2) == 1 && array.strides(1) == 3 && array.strides(0) >= 3 * columns;
  if (!dense_rows) array = py::array_t<unsigned char, py::array::c_style>::ensure(array);
  if (!array) throw py::error_already_set();
  const cv::Mat3b bgr(static_cast<int>(rows), static_cast<int>(columns),
                      static_cast<cv::Vec3b*>(const_cast<void*>(array.data())),
                      static_cast<std::size_t>(array.strides(0)));
  return {array, bgr};
}

py::array array_of(const cv::Mat3b& bgr) {
  auto* kept = new cv::Mat3b(bgr);
  const py::capsule owner(kept, [](void* mat) { delete static_cast<cv::Mat3b*>(mat); });
  return py::array(py::dtype::of<unsigned char>(), {kept->rows, kept->cols, 3},
                   {static_cast<py::ssize_t>(kept->step[0]), py::ssize_t{3}, py::ssize_t{1}}, kept->data,
                   owner);
}

py::array view(const py::dtype& type, std::vector<py::ssize_t> shape, std::vector<py::ssize_t> strides,
               const void* data, const py::handle& owner) {
  py::array array(type, std::move(shape), std::move(strides), data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

py::array_t<double> array_of(const Pose& pose_mm) {
  py::array_t<double> array({4, 4});
  auto numbers = array.mutable_unchecked<2>();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      numbers(r, c) = pose_mm.matrix()(r, c) * (r < 3 && c == 3 ? kMetersPerMm : 1.0);
  return array;
}

Pose pose_of(const py::object& object, const std::string& name) {
  constexpr double kRotationTolerance = 1e-4;
  const auto array =
      py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(require_array(object, name));
  if (!array) {
    PyErr_Clear();
    throw py::type_error(name + ": expected an array of numbers");
  }
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4)
    throw Error(name + ": expected a 4x4 matrix, got shape " + shape_text(array));
  Eigen::Matrix4d matrix;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) matrix(r, c) = array.at(r, c);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = matrix.allFinite() && matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                     (rotation * rotation.transpose()).isIdentity(kRotationTolerance) &&
                     rotation.determinant() > 0;
  if (!rigid) throw Error(name + ": not a rigid motion [R t; 0 0 0 1]");
  Pose pose_mm(matrix);
  pose_mm.translation() /= kMetersPerMm;
  return normalized(pose_mm);
}

py::array_t<double> poses_of(const std::vector<StampedPose>& trajectory) {
  py::array_t<double> array({static_cast<py::ssize_t>(trajectory.size()), py::ssize_t{4}, py::ssize_t{4}});
  auto numbers = array.mutable_unchecked<3>();
  for (std::size_t i = 0; i < trajectory.size(); ++i)
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c)
        numbers(static_cast<py::ssize_t>(i), r, c) =
            trajectory[i].map_T_sensor.matrix()(r, c) * (r < 3 && c == 3 ? kMetersPerMm : 1.0);
  return array;
}

py::array_t<double> times_of(const std::vector<StampedPose>& trajectory) {
  py::array_t<double> array(static_cast<py::ssize_t>(trajectory.size()));
  auto numbers = array.mutable_unchecked<1>();
  for (std::size_t i = 0; i < trajectory.size(); ++i)
    numbers(static_cast<py::ssize_t>(i)) = trajectory[i].time_s;
  return array;
}

py::array_t<double> scaled_array_of(const Matrix6d& rotation_first, double per_mm) {
  // The matrix is symmetric, so row-major and column-major order are the same.
  const Matrix6d matrix = translation_first(rotation_first, per_mm);
  return py::array_t<double>({6, 6}, matrix.data());
}

}  // namespace gelslam::python
