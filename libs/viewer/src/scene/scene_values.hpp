#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/slam/live_session.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// 1, 2 or 5 times a power of ten that nearly all of the distances are below; 1 without any.
float round_limit_mm(std::vector<float> distance_mm);

/// `distance_mm` made fit for drawing: as many as the vertices, none of them NaN.
std::vector<float> drawable_values(std::vector<float> distance_mm, std::size_t vertices);

/// How much a keyframe's place is in doubt, in red, by id along rows of kDoubtColumns: 0 where two standard
/// deviations are `from_mm`, 255 where they are `to_mm`.
cv::Mat4b doubt_by_keyframe(const MapSnapshot& map, double from_mm, double to_mm);
inline constexpr int kDoubtColumns = 256;

/// Where the keyframes of the shown component touch.
class KeyframePlaces {
 public:
  KeyframePlaces() = default;
  explicit KeyframePlaces(const MapSnapshot& map);

  /// Per vertex the id of the keyframe that sees it best: as the mesh says, else the nearest that looks at
  /// its side.
  std::vector<float> best(const DrawableMesh& piece) const;
  std::array<float, 2> range() const;  ///< of ids

 private:
  struct Place {
    float id;
    Eigen::Vector3f center_mm, outward;
  };
  std::vector<Place> places_;
};

}  // namespace gelslam::viewer::detail
