#include "gelslam/surface/camera_model.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace gelslam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A camera whose parameters all differ from their default values.
CameraModel bent() { return {{320, 240}, 0.0634, {0.045, {3, -2}, 1.02, 22, {0.0017, 0.0028}}}; }
CameraModel flat() { return {{320, 240}, 0.0634}; }

TEST(CameraModel, FindsEveryPixelAgainAndNoneBeyondThePicture) {
  for (CameraModel camera : {flat(), bent()}) {
    camera.size = {32, 24};
    for (int v = -1; v <= camera.size.height; ++v)
      for (int u = -1; u <= camera.size.width; ++u) {
        const cv::Point pixel(u, v);
        const bool inside = u >= 0 && v >= 0 && u < camera.size.width && v < camera.size.height;
        const Vector3d point = camera.point_mm(pixel, -0.7);
        EXPECT_EQ(camera.pixel_at(point), inside ? std::optional(pixel) : std::nullopt);
        EXPECT_TRUE(camera.to_px(camera.project(point)).isApprox(Vector2d(u, v)));
      }
  }
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(bent().pixel_at({kNowhere, 0, 0}));
  EXPECT_FALSE(bent().pixel_at({0, 0, -23})) << "behind the camera";
}

TEST(CameraModel, ReliefIsTheIntegralOfHeightsScaledByTheirDistance) {
  EXPECT_EQ(flat().relief_mm(-0.9), -0.9);
  double relief = 0;  // dw = dz / (1 + z / D), by the midpoint rule
  constexpr int kSteps = 1000;
  for (int k = 0; k < kSteps; ++k) relief += -0.9 / kSteps / (1 - 0.9 * (k + 0.5) / kSteps / 22);
  EXPECT_NEAR(bent().relief_mm(-0.9), relief, 1e-8);
  EXPECT_NEAR(bent().height_mm(relief), -0.9, 1e-8);
}

TEST(CameraModel, LensMovesThePixelsAsItsFormulaSays) {
  const CameraModel camera = bent();
  const Vector2d rest(7, -4), half_widths = rest / (160 * 0.0634);
  const Vector2d r(half_widths.x() * std::sqrt(1.02), half_widths.y() / std::sqrt(1.02));
  const Vector2d raw = Vector2d(159.5 + 3, 119.5 - 2) + 160 * r * (1 + 0.045 * r.squaredNorm());
  EXPECT_TRUE(camera.raw_px(camera.to_px(rest))->isApprox(raw, 1e-12));
}

TEST(CameraModel, RawAndRestPixelsAreInverse) {
  for (const double k1 : {0.3, 0.045, 0.0, -0.05}) {
    CameraModel camera = bent();
    camera.optics.lens_k1 = k1;
    for (int v = 0; v < 240; v += 13)
      for (int u = 0; u < 320; u += 17) {
        const Vector2d raw(u, v);
        EXPECT_LT((*camera.raw_px(camera.rectified_px(raw)) - raw).norm(), 1e-9)
            << k1 << ": " << u << ' ' << v;
      }
  }
  for (int u = 0; u < 320; u += 17)
    EXPECT_EQ(flat().rectified_px({u, 31}), Vector2d(u, 31)) << "without a lens nothing moves";
}

TEST(CameraModel, LensThatBendsRaysBackShowsNothingBeyond) {
  CameraModel camera = flat();
  camera.optics.lens_k1 = -0.3;
  EXPECT_FALSE(camera.raw_px({0, 0}));
  EXPECT_TRUE(camera.rectified_px({0, 0}).allFinite());
}

TEST(CameraModel, RestPointLiesOnTheRayAndOnTheGel) {
  const CameraModel camera = bent();
  const Vector2d rest(9, -6);
  const Vector3d point = camera.rest_point_mm(rest);
  EXPECT_TRUE(camera.project(point).isApprox(rest, 1e-12));
  EXPECT_NEAR(point.z(), camera.rest_height_mm(point.head<2>()), 1e-12);
  EXPECT_LT(point.z(), -0.2);
  constexpr double kStep = 1e-5;
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2d step = kStep * Vector2d::Unit(axis);
    EXPECT_NEAR(camera.rest_slope(rest)[axis],
                (camera.rest_height_mm(rest + step) - camera.rest_height_mm(rest - step)) / (2 * kStep),
                1e-9);
  }
  EXPECT_EQ(flat().rest_point_mm(rest), Vector3d(9, -6, 0));
}

}  // namespace
}  // namespace gelslam
