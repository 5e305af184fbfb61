#pragma once

#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/viewer/orbit_camera.hpp"
#include "gelslam/viewer/scene.hpp"

namespace gelslam {

/// A picture to draw into instead of a window: color and depth, several samples per pixel. Needs a current
/// context.
class RenderTarget {
 public:
  static constexpr int max_side_px = 8192;

  /// Throws Error when a side is not within 1 to max_side_px or the driver has no memory for it.
  RenderTarget(int width_px, int height_px, int samples = 4);
  ~RenderTarget();
  RenderTarget(const RenderTarget&) = delete;
  RenderTarget& operator=(const RenderTarget&) = delete;

  /// All drawing goes here, viewport included, until another framebuffer is bound.
  void bind();
  /// What has been drawn, 8-bit BGR, top row first. The target stays bound.
  cv::Mat3b read();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One picture of a scene. Finer levels of detail are made first, so that the picture does not depend on what
/// was drawn before.
cv::Mat3b render_scene_offscreen(Scene& scene, const OrbitCamera& camera, const SceneStyle& style,
                                 int width_px, int height_px);

}  // namespace gelslam
