#include "photometry/light.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "gelslam/surface/surface_estimator.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

// Returns the position of a pixel relative to the center of the picture: -1 to 1 to the right and downward.
cv::Vec2d place(int u, int v) {
  return {2.0 * u / (kSensor.width - 1) - 1.0, 2.0 * v / (kSensor.height - 1) - 1.0};
}

// Returns a picture of the linear gel under lamps that are brighter on one side, as on a real sensor.
// Otherwise a gain could not be distinguished from an offset. The slopes are then slightly wrong, equally
// with every light, so the tests compare pictures with each other.
cv::Mat3b lit(const cv::Mat1f& height_mm, std::uint64_t seed) {
  const cv::Mat3b image = render(height_mm, kPitchMm, 1.0, seed);
  return pixel_map<cv::Vec3b>(kSensor, [&](int u, int v) {
    const auto [x, y] = place(u, v).val;
    const double pattern = 8 * std::sin(6 * x) * std::cos(5 * y);
    return cv::Vec3d(image(v, u)) + cv::Vec3d(0, 25 * y + pattern, 25 * x + pattern);
  });
}

using Change = std::function<double(double value, double x, double y, int channel)>;

SurfacePtr seen(SurfaceEstimator& estimator, const cv::Mat1f& height_mm, const Change& change) {
  const cv::Mat3b image = lit(height_mm, 2);
  return estimator.estimate(pixel_map<cv::Vec3b>(kSensor, [&](int u, int v) {
    const auto [x, y] = place(u, v).val;
    const cv::Vec3b& light = image(v, u);
    return cv::Vec3d(change(light[0], x, y, 0), change(light[1], x, y, 1), change(light[2], x, y, 2));
  }));
}

SurfaceEstimator estimator(const SurfaceOptions& options = {}) {
  return SurfaceEstimator(linear_gel_model(), lit(kFlatGel, 1), options);
}

// Returns a name by which messages distinguish the changes.
std::string name(const Change& change) {
  return std::to_string(change(100, 0, 0, 0)) + " " + std::to_string(change(100, 1, 1, 1));
}

// Returns the largest difference (mm) between the heights from a picture in a changed light and those in the
// light of the background. The changed picture is the first one that the estimator sees.
double worst_height_mm(const cv::Mat1f& height_mm, const Change& change) {
  SurfaceEstimator disturbed = estimator();
  const SurfacePtr truth = estimator().estimate(lit(height_mm, 2));
  return cv::norm(seen(disturbed, height_mm, change)->height_mm, truth->height_mm, cv::NORM_INF);
}

cv::Mat1f press(double depth_mm, double u = 140, double v = 110) {
  return ball_press(kSensor, kPitchMm, u, v, 4.75, depth_mm);
}

const Change kDark = [](double value, double, double, int) { return 0.6 * value; };
const Change kBright = [](double value, double, double, int) { return 1.3 * value; };
const Change kWarm = [](double value, double, double, int c) {
  return value * (c == 0 ? 0.7 : c == 2 ? 1.25 : 0.95);
};
const Change kWeakRed = [](double value, double, double, int c) { return c == 2 ? 0.3 * value : value; };
const Change kWindow = [](double value, double x, double y, int) {
  return value + 6 + 8 * (x + 1) + 4 * (y + 1);
};
const Change kOneSide = [](double value, double, double y, int) { return value * (1 - 0.06 * (1 - y)); };

// A lamp that flickers during a rolling shutter, which changes rows of the picture, also those of the
// contact.
const Change kBands = [](double value, double, double y, int) {
  return value * (1 + 0.1 * std::sin(5 * y + 1));
};

// Stray light through a gap. It falls on a part of the gel and of the contact, and is not quite white.
Change band_of(double levels) {
  return [levels](double value, double x, double, int c) {
    return value + levels * (c == 0 ? 0.8 : c == 1 ? 1.0 : 1.1) * std::exp(-std::pow((x - 0.2) / 0.44, 2));
  };
}

// The error may be a tenth of the depth, because in the weak channel 8 bits resolve only a third as many
// levels.
TEST(Light, ThatJumpsIsFollowedAtOnce) {
  for (const Change& change : {kDark, kBright, kWarm, kWeakRed})
    EXPECT_LT(worst_height_mm(press(0.5), change), 0.05) << name(change);
}

TEST(Light, FromOneSideOrInBandsIsTakenOff) {
  for (const Change& change : {kWindow, kOneSide, kBands, band_of(8), band_of(-8), band_of(15)})
    EXPECT_LT(worst_height_mm(press(0.5), change), 0.05) << name(change);
}

TEST(Light, OnBareGelIsNoTouch) {
  for (const Change& change : {kDark, kBright, kWarm, kWindow, kOneSide, kBands, band_of(15)}) {
    SurfaceEstimator disturbed = estimator();
    EXPECT_EQ(seen(disturbed, kFlatGel, change)->contact_pixels, 0) << name(change);
  }
}

TEST(Light, ThatIsNotFollowedIsSaid) {
  for (const double depth_mm : {0.1, 0.5, 1.4})
    for (const double levels : {0.0, 15.0, 60.0}) {
      SurfaceEstimator disturbed = estimator();
      seen(disturbed, press(depth_mm), band_of(levels));
      EXPECT_EQ(disturbed.light_is_followed(), levels < 20) << levels << " over " << depth_mm << " mm";
    }
}

// A press tilts the gel to all sides, and a large one over most of the picture. It must not be taken for a
// change of light.
TEST(Light, IsNotWhatAPressChanges) {
  for (const double depth_mm : {0.2, 0.5, 0.9, 1.4}) {
    for (const double u : {40.0, 160.0, 300.0}) {
      const cv::Mat1f truth = press(depth_mm, u, 120);
      SurfaceOptions fixed;
      fixed.compensate_light = false;
      const SurfacePtr expected = estimator(fixed).estimate(lit(truth, 2));
      EXPECT_LT(cv::norm(estimator().estimate(lit(truth, 2))->height_mm, expected->height_mm, cv::NORM_INF),
                0.005 + 0.02 * depth_mm)
          << depth_mm << " mm at " << u;
    }
  }
}

// While a lamp is off, or while pictures show something else, no light is accepted. Afterwards the heights
// must be right again.
TEST(Light, ThatCannotBeIsForgotten) {
  const Change no_red = [](double value, double, double, int c) { return c == 2 ? 0.0 : value; };
  const Change green = [](double, double, double, int c) { return c == 1 ? 135.0 : 0.0; };
  const Change stripes = [](double, double x, double, int c) { return 128 + 100 * std::sin(40 * x + c); };
  for (const Change& change : {no_red, green, stripes}) {
    SurfaceEstimator disturbed = estimator();
    for (int frame = 0; frame < 3; ++frame) seen(disturbed, press(0.5), change);
    const SurfacePtr after = disturbed.estimate(lit(press(0.5), 2)),
                     truth = estimator().estimate(lit(press(0.5), 2));
    EXPECT_LT(cv::norm(after->height_mm, truth->height_mm, cv::NORM_INF), 0.02);
  }
}

}  // namespace
}  // namespace gelslam::test
