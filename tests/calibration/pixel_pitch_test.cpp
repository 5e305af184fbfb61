// Pixel pitch from rulers and bolts pressed into the simulated gel, and from balls.

#include "gelslam/calibration/pixel_pitch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

constexpr double kPitchMm = 0.0634;

/// A flat ruler whose marks are grooves, turned by `angle_deg`, pressed 0.15 mm deep by a sensor of this
/// pitch.
cv::Mat3b ruler_press(double period_mm, double angle_deg, double groove_share = 0.35, double noise = 1.0) {
  const SensorGeometry geometry;
  cv::Mat1f underside(geometry.height_px, geometry.width_px);
  const double angle = angle_deg * std::numbers::pi / 180.0;
  for (int v = 0; v < underside.rows; ++v)
    for (int u = 0; u < underside.cols; ++u) {
      const double along = geometry.x_mm(u) * std::cos(angle) + geometry.y_mm(v) * std::sin(angle);
      const double share = along / period_mm - std::floor(along / period_mm);
      underside(v, u) = share < groove_share ? 0.05F : -0.15F;
    }
  OpticsOptions optics;
  optics.noise_gain = noise;
  return Optics(geometry, optics).render(press_gel(underside, geometry, {}), 7, 0.0, false);
}

/// The thread of a bolt that lies on the gel: a narrow contact, deepest in its middle.
cv::Mat3b bolt_press(double period_mm, double angle_deg) {
  const SensorGeometry geometry;
  cv::Mat1f underside(geometry.height_px, geometry.width_px);
  const double angle = angle_deg * std::numbers::pi / 180.0, radius_mm = 3.0;
  for (int v = 0; v < underside.rows; ++v)
    for (int u = 0; u < underside.cols; ++u) {
      const double along = geometry.x_mm(u) * std::cos(angle) + geometry.y_mm(v) * std::sin(angle),
                   across = geometry.y_mm(v) * std::cos(angle) - geometry.x_mm(u) * std::sin(angle);
      const double thread = 0.2 * std::abs(2.0 * (along / period_mm - std::floor(along / period_mm)) - 1.0);
      const double bent = radius_mm - std::sqrt(std::max(0.01, radius_mm * radius_mm - across * across));
      underside(v, u) = static_cast<float>(-0.4 + thread + bent);
    }
  return Optics(geometry, {}).render(press_gel(underside, geometry, {}), 7, 0.0, false);
}

const cv::Mat3b& the_bare_gel() {
  static const cv::Mat3b background = bare_gel();
  return background;
}

/// The same scene, seen with pixels `factor` times as high.
cv::Mat3b with_higher_pixels(const cv::Mat3b& picture, double factor) {
  cv::Mat3b result;
  cv::resize(picture, result, cv::Size(picture.cols, cvRound(picture.rows / factor)), 0, 0, cv::INTER_AREA);
  return result;
}

TEST(Pattern, IsMeasuredWithinAPercentHoweverItLies) {
  for (const double angle_deg : {0.0, 90.0, 37.0, -20.0, 128.0})
    for (const double period_mm : {0.7, 1.0, 1.6}) {
      const auto wave =
          find_pattern(ruler_press(period_mm, angle_deg), the_bare_gel(), 1.1 * period_mm / kPitchMm);
      ASSERT_TRUE(wave) << angle_deg << " " << period_mm;
      // The lamps' change over the gel shifts the wave by a twentieth of a period or so.
      const double error = wave->period_px() * kPitchMm / period_mm - 1.0;
      EXPECT_LT(std::abs(error), 0.09 * period_mm / 15.2) << angle_deg << " " << period_mm;
      EXPECT_LT(std::abs(error), 3.0 * wave->uncertainty) << angle_deg << " " << period_mm;
      EXPECT_LT(wave->uncertainty, 0.01) << angle_deg << " " << period_mm;
    }
}

TEST(Pattern, ABoltWillDo) {
  for (const double angle_deg : {0.0, 90.0}) {
    const auto wave = find_pattern(bolt_press(0.8, angle_deg), the_bare_gel(), 0.8 / 0.07);
    ASSERT_TRUE(wave) << angle_deg;
    EXPECT_NEAR(wave->period_px() * kPitchMm / 0.8, 1.0, 0.005) << angle_deg;
  }
}

TEST(Pattern, IsNotFoundWhereThereIsNone) {
  EXPECT_FALSE(find_pattern(the_bare_gel(), the_bare_gel(), 15.0));
  EXPECT_FALSE(find_pattern(press_number(3).bgr, the_bare_gel(), 15.0)) << "a ball";
  EXPECT_FALSE(find_pattern(ruler_press(1.0, 0.0), the_bare_gel(), 31.0)) << "half of its frequency";
  EXPECT_FALSE(find_pattern(ruler_press(1.0, 0.0), the_bare_gel(), 1.0));
  EXPECT_FALSE(find_pattern(ruler_press(1.0, 0.0), the_bare_gel(), 200.0)) << "fewer than four periods";
  EXPECT_FALSE(find_pattern(ruler_press(1.0, 0.0), the_bare_gel(), std::nan("")));
}

TEST(Pattern, TwoDirectionsTellBothAxes) {
  const cv::Mat3b background = with_higher_pixels(the_bare_gel(), 1.06);
  std::vector<PatternWave> waves;
  for (const double angle_deg : {0.0, 90.0, 40.0})
    waves.push_back(
        find_pattern(with_higher_pixels(ruler_press(1.0, angle_deg), 1.06), background, 1.0 / kPitchMm)
            .value());
  const double rows = background.rows;  // the factor, after rounding to whole rows
  const PixelPitch pitch = pitch_from_pattern(waves, 1.0);
  EXPECT_TRUE(pitch.both_axes);
  EXPECT_NEAR(pitch.x_mm / kPitchMm, 1.0, 0.003);
  EXPECT_NEAR(pitch.y_mm / kPitchMm, 240.0 / rows, 0.004);
  EXPECT_LT(std::abs(pitch.y_mm - kPitchMm * 240.0 / rows), 4.0 * pitch.y_uncertainty_mm);
}

TEST(Pattern, OneDirectionTellsOnlyOne) {
  const PatternWave wave{1.0 / 15.0, 0.0, 0.001};
  const PixelPitch pitch = pitch_from_pattern({wave, wave}, 1.5);
  EXPECT_FALSE(pitch.both_axes);
  EXPECT_NEAR(pitch.x_mm, 0.1, 1e-9);
  EXPECT_EQ(pitch.x_mm, pitch.y_mm);
  EXPECT_THROW(pitch_from_pattern({}, 1.0), std::invalid_argument);
  EXPECT_THROW(pitch_from_pattern({wave}, 0.0), std::invalid_argument);
}

/// The middle ones of the simulated presses: whole in the picture, with true zones.
std::optional<PixelAspect> aspect_with(double factor) {
  static const SimulatedPresses presses = simulated_presses(0, 16);
  PressSet set = presses.set;
  set.background = with_higher_pixels(set.background, factor);
  std::vector<BallZone> zones;
  for (std::size_t k = 0; k < set.presses.size(); ++k) {
    set.presses[k].bgr = with_higher_pixels(set.presses[k].bgr, factor);
    const BallPress& truth = presses.truth[k];
    if (truth.radius_px > 15.0)
      zones.push_back(
          {k, truth.center_px.x, (truth.center_px.y + 0.5) / factor - 0.5, truth.radius_px - 3.0});
  }
  return aspect_from_balls(set, zones, kPitchMm);
}

TEST(BallAspect, SeesPixelsThatAreNotSquare) {
  for (const double factor : {1.0, 1.08, 0.93}) {
    const auto aspect = aspect_with(factor);
    ASSERT_TRUE(aspect);
    EXPECT_NEAR(aspect->y_over_x, factor, 0.02) << factor;
    EXPECT_LT(aspect->uncertainty, 0.02) << factor;
  }
}

TEST(BallAspect, NeedsSomePresses) {
  const SimulatedPresses presses = simulated_presses(0, 2);
  EXPECT_FALSE(aspect_from_balls(presses.set, {}, kPitchMm));
}

}  // namespace
}  // namespace gelslam::test
