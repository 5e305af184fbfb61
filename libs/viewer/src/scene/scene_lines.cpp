#include "scene/scene_lines.hpp"

#include <cstddef>
#include <map>

namespace gelslam::viewer::detail {

static_assert(sizeof(SceneLine) == 32, "SceneLine is read by the GPU as it lies in memory");

SceneLines::SceneLines() {
  glBindVertexArray(vertex_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  set_attribute<SceneLine>(0, 3, offsetof(SceneLine, from_mm));
  set_attribute<SceneLine>(1, 3, offsetof(SceneLine, to_mm));
  set_attribute<SceneLine>(2, 4, offsetof(SceneLine, color), GL_UNSIGNED_BYTE);
  set_attribute<SceneLine>(3, 1, offsetof(SceneLine, width_px));
  for (GLuint place = 0; place < 4; ++place) glVertexAttribDivisor(place, 1);
  glBindVertexArray(0);
}

void SceneLines::set(const std::vector<SceneLine>& lines) {
  count_ = static_cast<GLsizei>(lines.size());
  upload(GL_ARRAY_BUFFER, instances_, lines);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
}

void SceneLines::draw() const {
  glBindVertexArray(vertex_array_.name());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count_);
  glBindVertexArray(0);
}

namespace {

using Eigen::Vector3f;

constexpr Rgba kTrajectory{64, 190, 255, 255}, kDot{245, 245, 245, 255};
constexpr Rgba kOdometry{150, 158, 170, 230}, kLoop{70, 214, 130, 200}, kOutlier{255, 60, 60, 255};
constexpr float kAxisMm = 1.0F;

/// Returns the center of a keyframe's contact, lifted away from the object, or the sensor's center without
/// contact.
Vector3f anchor(const Pose& map_T_sensor) {
  return (map_T_sensor * Eigen::Vector3d(0, 0, -kHoverMm)).cast<float>();
}

bool is_shown(const MapSnapshot& map, const MapSnapshot::Node& node) {
  return node.component == map.shown_component;
}

}  // namespace

std::vector<SceneLine> trajectory_lines(const std::vector<std::vector<Pose>>& map_T_sensor) {
  std::vector<SceneLine> lines;
  for (const std::vector<Pose>& segment : map_T_sensor) {
    for (std::size_t i = 1; i < segment.size(); ++i)
      lines.push_back({anchor(segment[i - 1]), anchor(segment[i]), kTrajectory, 2.5F});
  }
  return lines;
}

std::vector<SceneLine> keyframe_lines(const MapSnapshot& map) {
  constexpr Rgba axis_colors[] = {{235, 80, 70, 255}, {90, 200, 90, 255}, {80, 130, 255, 255}};
  std::vector<SceneLine> lines;
  for (const MapSnapshot::Node& node : map.nodes) {
    if (!is_shown(map, node)) continue;
    const Vector3f from = anchor(node.component_T_keyframe);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3f direction = node.component_T_keyframe.linear().col(axis).cast<float>();
      lines.push_back({from, from + kAxisMm * direction, axis_colors[axis], 1.5F});
    }
    lines.push_back({from, from, kDot, 6.0F});
  }
  return lines;
}

std::vector<SceneLine> edge_lines(const MapSnapshot& map) {
  std::map<int, Vector3f> place;
  for (const MapSnapshot::Node& node : map.nodes)
    if (is_shown(map, node)) place.emplace(node.keyframe, anchor(node.component_T_keyframe));
  std::vector<SceneLine> lines;
  for (const MapSnapshot::Edge& edge : map.edges) {
    const auto from = place.find(edge.from), to = place.find(edge.to);
    if (from == place.end() || to == place.end()) continue;
    const bool loop = edge.kind == EdgeKind::loop;
    lines.push_back({from->second, to->second,
                     edge.outlier ? kOutlier
                     : loop       ? kLoop
                                  : kOdometry,
                     edge.outlier ? 2.5F : 1.5F});
  }
  return lines;
}

}  // namespace gelslam::viewer::detail
