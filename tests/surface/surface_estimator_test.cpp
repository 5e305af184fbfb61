#include "gelslam/surface/surface_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

constexpr double kBallMm = 4.75;

cv::Mat3b bare_gel(cv::Size size = kSensor) { return render(cv::Mat1f(size, 0.0F), kPitchMm, 0.0, 1); }

SurfaceEstimator make_estimator(const SurfaceOptions& options = {}, cv::Size size = kSensor) {
  return SurfaceEstimator(linear_gel_model(), bare_gel(size), options);
}

cv::Mat1f press(double depth_mm, double u = 160.0, double v = 120.0) {
  return ball_press(kSensor, kPitchMm, u, v, kBallMm, depth_mm);
}

// Returns the fraction of the contact that lies within `radius_px` of the center of the ball.
double share_within(const Surface& surface, double u, double v, double radius_px) {
  const auto inside = pixel_map<uchar>(kSensor, [&](int column, int row) {
    return surface.contact(row, column) != 0 && std::hypot(column - u, row - v) <= radius_px;
  });
  return static_cast<double>(cv::countNonZero(inside)) / std::max(1, surface.contact_pixels);
}

double disc_px(double radius_px) { return 3.14159265 * radius_px * radius_px; }

TEST(SurfaceEstimator, GivesBackTheHeightOfAPressedBall) {
  for (const double depth_mm : {0.1, 0.4, 0.8}) {
    const cv::Mat1f truth = press(depth_mm, 150, 130);
    const SurfacePtr surface = make_estimator().estimate(render(truth, kPitchMm, 1.0, 2));
    // 8-bit colors and noise cause an error of a few micrometers, and so do slopes outside the changed area,
    // which are taken for zero.
    EXPECT_LT(cv::norm(surface->height_mm, truth, cv::NORM_INF), 0.006 + 0.02 * depth_mm) << depth_mm;
    EXPECT_EQ(surface->pixel_pitch_mm, kPitchMm);
  }
}

TEST(SurfaceEstimator, SeesNoTouchInATestPicture) {
  const auto bars = pixel_map<cv::Vec3b>(kSensor, [](int u, int) {
    const int bar = 7 * u / kSensor.width;
    return cv::Vec3b(bar % 2 ? 0 : 191, bar < 4 ? 191 : 0, bar % 4 < 2 ? 191 : 0);
  });
  const SurfacePtr surface = make_estimator().estimate(bars);
  EXPECT_EQ(cv::norm(surface->height_mm, cv::NORM_INF), 0) << "it would be deeper than any gel is thick";
  EXPECT_EQ(surface->contact_pixels, 0);
  EXPECT_EQ(cv::countNonZero(surface->contact), 0);
}

/// The height and slope at which a ray meets a domed gel into which a ball is pressed.
struct Seen {
  double z = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  bool ball = false;
};

Seen seen_along(const CameraModel& camera, const Eigen::Vector2d& rest_mm, const Eigen::Vector3d& ball_mm) {
  const Eigen::Vector3d rest = camera.rest_point_mm(rest_mm);
  const double distance = camera.optics.camera_distance_mm;
  // The ray (x, y, z) = ((1 + z / distance) X, z) meets the ball at two points, of which the lower one is
  // seen.
  const Eigen::Vector3d along(rest_mm.x() / distance, rest_mm.y() / distance, 1);
  const Eigen::Vector3d from_middle = Eigen::Vector3d(rest_mm.x(), rest_mm.y(), 0) - ball_mm;
  const double half = along.dot(from_middle), length2 = along.squaredNorm(),
               root2 = half * half - length2 * (from_middle.squaredNorm() - kBallMm * kBallMm);
  const double z = root2 < 0 ? rest.z() : (-half - std::sqrt(root2)) / length2;
  if (z < rest.z()) {
    const Eigen::Vector3d normal = from_middle + z * along;
    return {z, -normal.head<2>() / normal.z(), true};
  }
  return {rest.z(), camera.rest_slope(rest.head<2>()), false};
}

/// Returns the raw image of this gel in the colors of linear_gel.hpp.
cv::Mat3b raw_picture(const CameraModel& camera, const Eigen::Vector3d& ball_mm) {
  return pixel_map<cv::Vec3b>(camera.size, [&](int u, int v) {
    const Seen seen = seen_along(camera, camera.to_mm(camera.rectified_px(Eigen::Vector2d(u, v))), ball_mm);
    const auto level = [&](int axis) { return kBareLevel + std::atan(seen.slope[axis]) / kRadPerLevel; };
    return cv::Vec3d(60.0 + 80.0 * u / camera.size.width, level(1), level(0));
  });
}

TEST(SurfaceEstimator, GivesBackABallOnADomedGelBehindALens) {
  GradientModel model = linear_gel_model();
  model.optics = {0.045, {3, -2}, 1.02, 22, {0.0017, 0.0028}};
  const CameraModel camera = camera_of(model, kSensor, {});
  constexpr double kFarMm = 100;
  SurfaceEstimator estimator(model, raw_picture(camera, {0, 0, kFarMm}), {});
  const Eigen::Vector3d ball(5, -2.5, kBallMm - 0.7);
  const SurfacePtr surface = estimator.estimate(raw_picture(camera, ball));
  EXPECT_EQ(surface->optics, *model.optics);
  for (int v = 8; v < kSensor.height; v += 16)
    for (int u = 8; u < kSensor.width; u += 16) {
      const cv::Point pixel(u, v);
      const Seen seen = seen_along(camera, camera.to_mm(pixel), ball);
      EXPECT_NEAR(surface->height_mm(pixel), seen.z, 0.02) << pixel;
      const bool is_seen = camera.pixel_of(*camera.raw_px(Eigen::Vector2d(u, v))).has_value();
      EXPECT_LE(surface->contact(pixel) != 0, seen.ball && is_seen) << pixel;
      if (!surface->contact(pixel)) continue;
      const cv::Vec3f& n = surface->normals(pixel);
      EXPECT_NEAR(-n[0] / n[2], seen.slope.x(), 0.02);
      EXPECT_NEAR(-n[1] / n[2], seen.slope.y(), 0.02);
      EXPECT_NEAR((surface->point_mm(pixel) - ball).norm(), kBallMm, 0.02) << pixel;
    }
  EXPECT_GT(surface->contact_pixels, 2000);
}

TEST(SurfaceEstimator, NormalsFollowTheSurfaceInsideAndAroundTheContact) {
  const cv::Mat1f truth = press(0.6);
  const SurfacePtr surface = make_estimator().estimate(render(truth, kPitchMm, 0.0, 2));
  for (int v = 2; v < kSensor.height - 2; ++v) {
    for (int u = 2; u < kSensor.width - 2; ++u) {
      const cv::Vec3f n = surface->normals(v, u);
      ASSERT_NEAR(cv::norm(n), 1.0, 1e-5);
      const double gx = (truth(v, u + 1) - truth(v, u - 1)) / (2 * kPitchMm);
      const double gy = (truth(v + 1, u) - truth(v - 1, u)) / (2 * kPitchMm);
      ASSERT_NEAR(-n[0] / n[2], gx, 0.012)
          << u << "," << v;  // half a gray level is 0.003, the change mask 0.01
      ASSERT_NEAR(-n[1] / n[2], gy, 0.012) << u << "," << v;
    }
  }
}

// The rule of the public system (a depth of 0.2 mm, then an erosion by 5 pixels) finds no contact in these
// pictures.
TEST(SurfaceEstimator, ShallowTouchesAreFound) {
  for (const double depth_mm : {0.06, 0.1, 0.2}) {
    const SurfacePtr surface = make_estimator().estimate(render(press(depth_mm), kPitchMm, 1.0, 4));
    const double true_px = contact_radius_px(kPitchMm, kBallMm, depth_mm);
    EXPECT_GT(surface->contact_pixels, 0.5 * disc_px(true_px)) << depth_mm;
    EXPECT_GT(share_within(*surface, 160, 120, true_px + 3), 0.95) << depth_mm;
  }
}

TEST(SurfaceEstimator, BareGelHasNoContactWhateverTheNoise) {
  for (const double noise : {0.0, 1.0, 3.0, 8.0}) {
    SurfaceEstimator estimator = make_estimator();
    for (std::uint64_t seed = 10; seed < 14; ++seed) {
      const SurfacePtr surface = estimator.estimate(bare_picture(noise, seed));
      EXPECT_LE(surface->contact_pixels, noise > 4.0 ? 20 : 0) << noise;
    }
  }
}

// A flat face has the color of bare gel. The larger of the two faces covers more of the picture than the bare
// gel.
TEST(SurfaceEstimator, AFlatFaceCountsAsContactThroughout) {
  for (const cv::Size half : {cv::Size(60, 50), cv::Size(110, 85)}) {
    // A punch 0.4 mm deep with sloping sides 1 mm wide.
    const auto truth = pixel_map<float>(kSensor, [&](int u, int v) {
      const int outside_px = std::max({0, std::abs(u - 160) - half.width, std::abs(v - 120) - half.height});
      return -0.4 * std::max(0.0, 1.0 - kPitchMm * outside_px);
    });
    const SurfacePtr surface = make_estimator().estimate(render(truth, kPitchMm, 1.0, 5));
    EXPECT_LT(cv::norm(surface->height_mm, truth, cv::NORM_INF), 0.03);
    const cv::Rect face(160 - half.width, 120 - half.height, 2 * half.width, 2 * half.height);
    EXPECT_EQ(cv::countNonZero(surface->contact(face) == 0), 0);
  }
}

// A cloth that is larger than the gel leaves no bare gel from which noise, light and the level of the heights
// could be estimated. Its pattern must be read nevertheless while it is pressed in slowly, up to an offset of
// the heights.
TEST(SurfaceEstimator, APatternOverTheWholeGelIsReadWithoutBareGel) {
  for (const double period_px : {22.0, 30.0, 45.0}) {
    SurfaceEstimator estimator = make_estimator();
    const double amplitude_mm = 0.3 * period_px * kPitchMm / (2 * CV_PI);  // slopes to 0.3
    const auto truth = pixel_map<float>(kSensor, [&](int u, int v) {
      return amplitude_mm * std::sin(2 * CV_PI * u / period_px) * std::sin(2 * CV_PI * v / period_px);
    });
    SurfacePtr surface;
    for (const double share : {0.25, 0.5, 1.0})
      surface = estimator.estimate(render(cv::Mat1f(truth * share), kPitchMm, 1.0, 2));
    EXPECT_FALSE(surface->zero_is_bare_gel) << period_px;
    EXPECT_GT(surface->contact_pixels, kSensor.area() / 5) << period_px;  // what lies below, without the rims
    cv::Mat1f difference;
    cv::subtract(surface->height_mm, truth, difference);
    cv::Scalar mean, scatter;
    cv::meanStdDev(difference, mean, scatter);
    EXPECT_LT(scatter[0], 0.03 * amplitude_mm + 0.002) << period_px;
  }
}

// Compares the contact with that in a wider picture of the same press, which the border does not cut. Up to
// 1.3 % of the contact differ. If heights and contact were continued straight beyond the border, 1.2 to 2.6 %
// would differ.
TEST(SurfaceEstimator, AContactThatCrossesTheBorderHasASmoothOutline) {
  const int margin = 80;
  const cv::Size wide(kSensor.width + 2 * margin, kSensor.height);
  const cv::Rect middle(cv::Point(margin, 0), kSensor);
  struct Press {
    double u, v, radius_mm, depth_mm;
  };
  for (const Press& at : {Press{310, 120, 4.75, 0.6},
                          {300, 60, 4.75, 0.6},
                          {5, 150, 4.75, 0.8},
                          {330, 120, 4.75, 0.9},
                          {312, 80, 3, 0.5},
                          {280, 120, 10, 1.0}}) {
    const cv::Mat3b image =
        render(ball_press(wide, kPitchMm, at.u + margin, at.v, at.radius_mm, at.depth_mm), kPitchMm, 1.0, 7);
    const cv::Mat1b expected = make_estimator({}, wide).estimate(image)->contact(middle).clone();
    SurfaceEstimator estimator(linear_gel_model(), bare_gel(wide)(middle).clone(), {});
    cv::Mat1b differs;
    cv::compare(estimator.estimate(image(middle).clone())->contact, expected, differs, cv::CMP_NE);
    EXPECT_LE(cv::countNonZero(differs), 0.014 * cv::countNonZero(expected)) << at.u << " " << at.v;
  }
}

TEST(SurfaceEstimator, RunsOnlyWhereTheImageChangedWithTheSameResultThere) {
  const cv::Mat3b image = render(press(0.5), kPitchMm, 1.0, 6);
  SurfaceOptions everywhere;
  everywhere.gradient_everywhere = true;
  const SurfacePtr some = make_estimator().estimate(image), all = make_estimator(everywhere).estimate(image);
  int ran = 0;
  for (int v = 0; v < kSensor.height; ++v) {
    for (int u = 0; u < kSensor.width; ++u) {
      const cv::Vec3f normal = some->normals(v, u);
      if (normal == cv::Vec3f(0, 0, 1)) continue;
      ++ran;
      ASSERT_EQ(normal, all->normals(v, u));
    }
  }
  EXPECT_GT(ran, some->contact_pixels);
  EXPECT_LT(ran, 2 * kSensor.area() / 3);
  EXPECT_LT(cv::norm(some->height_mm, all->height_mm, cv::NORM_INF), 0.01);
}

TEST(SurfaceEstimator, WorksAtOddSizesAndWithContactOverTheWholeGel) {
  const cv::Size odd(161, 121);
  const cv::Mat1f truth = ball_press(odd, kPitchMm, 80, 60, kBallMm, 0.3);
  const SurfacePtr surface = make_estimator({}, odd).estimate(render(truth, kPitchMm, 0.0, 1));
  EXPECT_LT(cv::norm(surface->height_mm, truth, cv::NORM_INF), 0.02);
  const SurfacePtr full =
      make_estimator().estimate(render(ball_press(kSensor, kPitchMm, 160, 120, 60.0, 3.0), kPitchMm, 0.0, 1));
  EXPECT_TRUE(cv::checkRange(full->height_mm) && cv::checkRange(full->normals));
  for (const int level : {0, 255}) {
    const SurfacePtr extreme =
        make_estimator().estimate(cv::Mat3b(kSensor, cv::Vec3b::all(static_cast<unsigned char>(level))));
    EXPECT_TRUE(cv::checkRange(extreme->height_mm) && cv::checkRange(extreme->normals));
  }
}

TEST(SurfaceEstimator, RefusesSizesThatDoNotFit) {
  SurfaceEstimator estimator = make_estimator();
  EXPECT_THROW(estimator.estimate(cv::Mat3b(120, 160)), Error);
  EXPECT_THROW(estimator.estimate(cv::Mat3b()), Error);
  EXPECT_THROW(make_estimator({}, cv::Size(320, 8)), Error);
}

}  // namespace
}  // namespace gelslam::test
