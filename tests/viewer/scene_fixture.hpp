#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gl/gl_context.hpp"
#include "scene/scene.hpp"
#include "test_meshes.hpp"

namespace gelslam::test {

using namespace viewer::detail;

/// Draws without a display; one context for all cases. Skips where nothing can draw.
class SceneDrawing : public testing::Test {
 protected:
  static constexpr int kWidth = 480, kHeight = 360;
  static constexpr Viewport kWhole{0, 0, kWidth, kHeight};

  static void SetUpTestSuite() {
    try {
      context_ = GlContext::offscreen();
    } catch (const Error& error) {
      reason_ = error.what();
    }
  }
  static void TearDownTestSuite() { context_.reset(); }
  void SetUp() override {
    if (!context_) GTEST_SKIP() << reason_;
    camera.set_distance_mm(30);
  }

  cv::Mat3b draw(Scene& scene) const {
    RenderTarget target(kWidth, kHeight);
    target.bind();
    scene.draw(camera, kWhole, style);
    return target.read();
  }

  /// 255 where the picture differs from the empty background.
  cv::Mat1b mask_of(const cv::Mat3b& picture) const {
    Scene nothing;
    const cv::Mat3b background = draw(nothing);
    cv::Mat1b mask(picture.size());
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x)
        mask(y, x) = cv::norm(picture(y, x), background(y, x), cv::NORM_INF) > 6 ? 255 : 0;
    }
    return mask;
  }

  /// Radius in pixels of a ball's outline in the middle of the picture: a cone tangent to it.
  float outline_px(double radius_mm) const {
    const double distance = camera.distance_mm();
    const double tangent = radius_mm / std::sqrt(distance * distance - radius_mm * radius_mm);
    return static_cast<float>(tangent * distance /
                              static_cast<double>(camera.mm_per_px(camera.distance_mm(), kWhole)));
  }

  OrbitCamera camera;
  SceneStyle style;

 private:
  static inline std::unique_ptr<GlContext> context_;
  static inline std::string reason_;
};

inline Mesh moved(Mesh mesh, const Eigen::Vector3f& by_mm) {
  for (Eigen::Vector3f& p : mesh.vertices_mm) p += by_mm;
  return mesh;
}

inline MeshBlock block(std::int64_t key, Mesh mesh) {
  MeshBlock result;
  result.key = key;
  result.mesh = std::move(mesh);
  return result;
}

inline MeshFeed::Changes changes(const std::vector<MeshBlock>& blocks, bool cleared = false) {
  MeshFeed::Changes result;
  result.cleared = cleared;
  for (const MeshBlock& block : blocks) result.blocks.push_back(std::make_shared<const MeshBlock>(block));
  return result;
}

inline double largest_difference(const cv::Mat3b& a, const cv::Mat3b& b) {
  return cv::norm(a, b, cv::NORM_INF);
}

}  // namespace gelslam::test
