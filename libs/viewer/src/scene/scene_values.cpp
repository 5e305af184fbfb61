#include "scene/scene_values.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gelslam/core/median.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

/// The middle of what a keyframe touched, in the sensor's frame.
Eigen::Vector3d contact_center(const MapSnapshot::Node& node) {
  if (!node.surface) return Eigen::Vector3d::Zero();
  const Eigen::Vector2d center_mm = node.surface.facts().contact_center_mm;
  return {center_mm.x(), center_mm.y(), 0};
}

}  // namespace

float round_limit_mm(std::vector<float> distance_mm) {
  std::erase_if(distance_mm, [](float d) { return !std::isfinite(d) || d < 0; });
  if (distance_mm.empty()) return 1;
  const float wanted = std::max(quantile_in_place(distance_mm, 0.98), 1e-4F);
  const float power = std::pow(10.0F, std::floor(std::log10(wanted)));
  for (const float step : {1.0F, 2.0F, 5.0F}) {
    if (step * power >= wanted) return step * power;
  }
  return 10 * power;
}

std::vector<float> drawable_values(std::vector<float> distance_mm, std::size_t vertices) {
  distance_mm.resize(vertices, kNoValue);
  for (float& d : distance_mm) {
    if (!std::isfinite(d)) d = kNoValue;
  }
  return distance_mm;
}

cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm) {
  const int last = map.nodes.empty() ? 0 : map.nodes.back().keyframe;
  cv::Mat4b doubt(1 + last / kDoubtColumns, kDoubtColumns, cv::Vec4b(0, 0, 0, 255));
  double sigma_mm = 0;  // of a keyframe that is not known yet: that of the one before
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != map.shown_component) continue;
    if (node.sigma_mm >= 0) sigma_mm = node.sigma_mm;
    doubt(node.keyframe / kDoubtColumns, node.keyframe % kDoubtColumns)[0] =
        cv::saturate_cast<uchar>(255 * (2 * sigma_mm - from_mm) / (to_mm - from_mm));
  }
  return doubt;
}

KeyframePlaces::KeyframePlaces(const MapSnapshot& map) {
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.component != map.shown_component || !node.component_T_keyframe.matrix().allFinite()) continue;
    places_.push_back({static_cast<float>(node.keyframe),
                       (node.component_T_keyframe * contact_center(node)).cast<float>(),
                       -node.component_T_keyframe.linear().col(2).cast<float>()});
  }
}

std::array<float, 2> KeyframePlaces::range() const {
  if (places_.empty()) return {0, 1};
  const auto [low, high] = std::minmax_element(places_.begin(), places_.end(),
                                               [](const Place& a, const Place& b) { return a.id < b.id; });
  return {low->id, std::max(high->id, low->id + 1)};
}

std::vector<float> KeyframePlaces::best(const DrawableMesh& piece) const {
  if (piece.keyframe.size() == piece.vertices_mm.size())
    return {piece.keyframe.begin(), piece.keyframe.end()};
  std::vector<float> values(piece.vertices_mm.size(), kNoValue);
  for (std::size_t i = 0; i < values.size(); ++i) {
    float best = std::numeric_limits<float>::infinity();
    for (const Place& place : places_) {
      const float distance2 = (piece.vertices_mm[i] - place.center_mm).squaredNorm();
      if (distance2 >= best || place.outward.dot(piece.normals[i]) < 0.2F) continue;
      best = distance2;
      values[i] = place.id;
    }
  }
  return values;
}

}  // namespace gelslam::viewer::detail
