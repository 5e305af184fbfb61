#include "gelslam/viewer/mesh_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "browse/view_window.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

using viewer::detail::ViewStage;
using viewer::detail::ViewWindow;

constexpr float kFreeForWords = 1.16F;  // room above and below the surface for titles, scale and legend

/// 1 for a flat patch, 0 for a closed surface. Throws Error for a mesh without area.
double one_sidedness(const Mesh& mesh) {
  Eigen::Vector3d vector_area = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices_mm.at(static_cast<std::size_t>(t[k])).cast<double>();
    };
    const Eigen::Vector3d twice_area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    vector_area += twice_area;
    area += twice_area.norm();
  }
  if (!(area > 0.0)) throw Error("the mesh has no area: nothing to draw");
  return vector_area.norm() / area;
}

/// Height of panels of this width for what the cameras see.
int panel_height(const ViewStage& stage, const std::vector<OrbitCamera>& cameras, int width_px) {
  Eigen::Vector2f size(1e-6F, 0.0F);
  for (const OrbitCamera& camera : cameras) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : stage.outline_mm()) box.extend(camera.map_R_camera().transpose() * p);
    size = size.cwiseMax(box.sizes().head<2>());
  }
  return static_cast<int>(static_cast<float>(width_px) *
                          std::clamp(kFreeForWords * size.y() / size.x(), 0.7F, 1.5F));
}

OrbitCamera fitted_view(const ViewStage& stage, OrbitCamera camera, const Viewport& panel) {
  camera.fit(stage.outline_mm(), panel);
  camera.set_distance_mm(kFreeForWords * camera.distance_mm());
  return camera;
}

cv::Mat3b side_by_side(const std::vector<cv::Mat3b>& panels) {
  cv::Mat3b picture;
  cv::hconcat(panels, picture);
  return picture;
}

ViewWindowOptions hidden_window() {
  ViewWindowOptions options;
  options.visible = false;
  return options;
}

SceneStyle style_by(SceneColor color) {
  SceneStyle style;
  style.light_theme = true;
  style.color = color;
  return style;
}

}  // namespace

cv::Mat3b draw_comparison(const Mesh& estimate, const Mesh& truth, int panel_width_px) {
  one_sidedness(estimate);
  one_sidedness(truth);
  const auto panels = [&](const char* title, SceneColor color) {
    ViewWindow window({title, estimate, std::nullopt}, ViewContent{"true shape", truth, std::nullopt},
                      hidden_window());
    const ViewStage& stage = window.stage();
    const int width = 2 * panel_width_px;
    const OrbitCamera camera = stage.first_view({0, 0, width, panel_width_px});
    const int height = panel_height(stage, {camera}, panel_width_px);
    window.host().resize(width, height);
    return window.snapshot(fitted_view(stage, camera, {0, 0, panel_width_px, height}), style_by(color));
  };
  const cv::Mat3b plain = panels("reconstruction", SceneColor::plain);
  const cv::Mat3b colored = panels("distance to the true shape", SceneColor::distance);
  return side_by_side({plain, colored.colRange(0, panel_width_px)});
}

cv::Mat3b draw_mesh(const Mesh& mesh, int panel_width_px) {
  const float turn_deg = one_sidedness(mesh) > 0.35 ? 50.0F : 120.0F;
  ViewWindow window({"", mesh, std::nullopt}, std::nullopt, hidden_window());
  const ViewStage& stage = window.stage();
  const Viewport square{0, 0, panel_width_px, panel_width_px};
  std::vector<OrbitCamera> cameras;
  for (const float angle_deg : {-turn_deg, 0.0F, turn_deg}) {
    OrbitCamera camera = stage.first_view(square);
    camera.orbit({angle_deg / 180.0F * static_cast<float>(panel_width_px), 0.0F}, square);
    cameras.push_back(camera);
  }
  const int height = panel_height(stage, cameras, panel_width_px);
  const Viewport panel{0, 0, panel_width_px, height};
  float distance_mm = 0;  // the same scale in all panels
  for (OrbitCamera& camera : cameras) {
    camera = fitted_view(stage, camera, panel);
    distance_mm = std::max(distance_mm, camera.distance_mm());
  }
  window.host().resize(panel_width_px, height);
  std::vector<cv::Mat3b> panels;
  for (OrbitCamera& camera : cameras) {
    camera.set_distance_mm(distance_mm);
    panels.push_back(window.snapshot(camera, style_by(SceneColor::plain)));
  }
  return side_by_side(panels);
}

void write_picture(const std::filesystem::path& path, const cv::Mat& picture) {
  if (path.has_parent_path() && !std::filesystem::is_directory(path.parent_path()))
    throw Error(path.string() + ": there is no folder " + path.parent_path().string());
  viewer::write_png(path, picture);
}

}  // namespace gelslam
