#pragma once

#include <array>
#include <span>
#include <vector>

#include "gelslam/slam/live_session.hpp"
#include "scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// Distances given per vertex of a whole mesh.
class VertexDistances {
 public:
  void clear() { distance_mm_.clear(), vertices_ = 0; }
  void set_vertex_count(std::size_t vertices) { vertices_ = vertices; }
  void set(std::span<const float> distance_mm);
  std::vector<float> of(const DrawableMesh& piece) const;
  /// What nearly all of them are below: 1, 2 or 5 times a power of ten.
  float round_limit_mm() const;

 private:
  std::size_t vertices_ = 0;
  std::vector<float> distance_mm_;
};

/// Where the keyframes of the shown group touch.
class KeyframePlaces {
 public:
  KeyframePlaces() = default;
  explicit KeyframePlaces(const MapSnapshot& map);

  /// Per vertex the id of the nearest keyframe that looks at its side.
  std::vector<float> nearest(const DrawableMesh& piece) const;
  std::array<float, 2> range() const;  ///< of ids

 private:
  struct Place {
    float id;
    Eigen::Vector3f centre_mm, outward;
  };
  std::vector<Place> places_;
};

}  // namespace gelslam::viewer::detail
