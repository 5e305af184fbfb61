#include "touched_points.hpp"

#include <cmath>

namespace gelslam::simulation::detail {

void TouchedPoints::add(const SimulatedFrame& frame) {
  const SensorGeometry& geometry = simulator_.spec().geometry;
  const Eigen::Matrix3f turn = frame.sensor_T_object.linear().cast<float>();
  const Eigen::Vector3f move = frame.sensor_T_object.translation().cast<float>();
  const auto per_mm = static_cast<float>(1 / geometry.pixel_pitch_mm);
  // A vertex lies up to half a pixel's diagonal from the pixel's center, on a slope of up to about 50
  // degrees.
  const auto same_sheet_mm = static_cast<float>(geometry.pixel_pitch_mm);
  const auto& vertices = simulator_.surface().vertices_mm;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    if (touched_[k]) continue;
    const float z = turn.row(2).dot(vertices[k]) + move.z();
    if (z > 0) continue;
    const float u =
        (turn.row(0).dot(vertices[k]) + move.x()) * per_mm + 0.5F * static_cast<float>(geometry.width_px);
    const float v =
        (turn.row(1).dot(vertices[k]) + move.y()) * per_mm + 0.5F * static_cast<float>(geometry.height_px);
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(geometry.width_px) &&
          v < static_cast<float>(geometry.height_px)))
      continue;
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    if (frame.contact(row, column) != 0 && std::abs(z - frame.height_mm(row, column)) < same_sheet_mm)
      touched_[k] = true;
  }
}

std::vector<float> TouchedPoints::points_m() const {
  std::vector<float> points;
  const auto& vertices = simulator_.surface().vertices_mm;
  for (std::size_t k = 0; k < vertices.size(); ++k)
    if (touched_[k])
      for (int axis = 0; axis < 3; ++axis) points.push_back(vertices[k][axis] * 1e-3F);
  return points;
}

}  // namespace gelslam::simulation::detail
