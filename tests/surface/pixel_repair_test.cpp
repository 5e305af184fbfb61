#include "photometry/pixel_repair.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "gelslam/surface/background.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

const cv::Mat3b kBare = bare_picture(0.0, 1);
const cv::Mat1f kBall = ball_press(kSensor, kPitchMm, 160, 120, 4.75, 0.6);
const cv::Mat3b kTouched = render(kBall, kPitchMm, 1.0, 2);

/// A white spot with soft edges, as a lens would show it.
void shine(cv::Mat3b& image, const std::vector<cv::Point>& places) {
  cv::Mat1f light(image.size(), 0.0F);
  for (const cv::Point& place : places) cv::circle(light, place, 4, 1.0, cv::FILLED);
  cv::GaussianBlur(light, light, {}, 1.2);
  image = pixel_map<cv::Vec3b>(image.size(), [&](int u, int v) {
    return cv::Vec3f(image(v, u)) + cv::Vec3f::all(300.0F * light(v, u));
  });
}

const std::vector<cv::Point> kOnContact = {{150, 110}, {175, 131}};
const std::vector<cv::Point> kOnGel = {{40, 40}, {280, 60}, {60, 200}};

SurfacePtr surface_of(const cv::Mat3b& image) {
  return SurfaceEstimator(linear_gel_model(), kBare, SurfaceOptions{}).estimate(image);
}

/// Expects that the heights are those of the ball to 0.03 mm, and that the contact is the same as without the
/// disturbance, except for a few pixels at its border, which is 600 pixels long.
void expect_undisturbed(const Surface& surface, const Surface& undisturbed) {
  EXPECT_LT(cv::norm(surface.height_mm, kBall, cv::NORM_INF), 0.03);
  const cv::Mat differing = surface.contact != undisturbed.contact;
  EXPECT_LT(cv::countNonZero(differing), undisturbed.contact_pixels / 30);
}

/// Adds printed dots at distances of 32 pixels, shifted by `shift_px`. One is missing, one is small, and one
/// is out of line.
cv::Mat3b with_dots(const cv::Mat3b& image, double shift_px = 0.0) {
  cv::Mat1f ink(image.size(), 0.0F);
  for (int v = 24; v < image.rows; v += 32)
    for (int u = 32; u < image.cols; u += 32) {
      if (u == 96 && v == 88) continue;
      constexpr int shift_bits = 4;
      const cv::Point place(cvRound((u + shift_px) * 16), v * 16);
      cv::circle(ink, place, (u == 64 && v == 56 ? 3 : 5) * 16, 1.0, cv::FILLED, cv::LINE_8, shift_bits);
    }
  cv::circle(ink, {208, 136}, 5, 1.0, cv::FILLED);
  cv::GaussianBlur(ink, ink, {}, 0.8);
  return shaded(image, cv::Mat1f(1.0F - 0.7F * ink));
}

TEST(WrongValues, AreCountedInTheLargestPictures) {
  const cv::Mat3b bare(2400, 2400, cv::Vec3b(90, 100, 110));
  cv::Mat3b noisy = bare.clone();
  for (int u = 3; u < noisy.cols; u += 3) noisy.col(u).setTo(cv::Scalar::all(255));
  surface::detail::PixelRepair repair(bare);
  EXPECT_LT(cv::norm(repair.clean(noisy), bare, cv::NORM_L1), 0.01 * cv::norm(noisy, bare, cv::NORM_L1));
}

TEST(Markers, ABallReadsAsWithoutThem) {
  const SurfacePtr clean = surface_of(kTouched);
  for (const double shift_px : {0.0, 2.0, 5.0}) {
    const SurfacePtr surface =
        SurfaceEstimator(linear_gel_model(), with_dots(kBare), {}).estimate(with_dots(kTouched, shift_px));
    EXPECT_LT(cv::norm(surface->height_mm, kBall, cv::NORM_INF), 0.03) << shift_px;
    EXPECT_LT(cv::countNonZero(surface->contact != clean->contact), clean->contact_pixels / 20) << shift_px;
    EXPECT_EQ(surface->confidence(120, 160), 1) << shift_px;
    EXPECT_GT(surface->confidence(136, 176), 100) << shift_px << ": between dots";
  }
}

TEST(Markers, AreFilledInUnderWhatIsSeenBare) {
  const MarkerFiller filler(with_dots(kBare));
  cv::Mat1b covered;
  EXPECT_LT(cv::norm(filler.background(), kBare, cv::NORM_INF), 4.0);
  EXPECT_LT(cv::norm(filler.fill(with_dots(kBare, 4.0), covered), kBare, cv::NORM_INF), 4.0);
  EXPECT_EQ(covered(56, 32), 255);
  const MarkerFiller none(kBare);
  EXPECT_EQ(cv::norm(none.background(), kBare), 0.0);
  EXPECT_EQ(cv::norm(none.fill(with_dots(kBare), covered), with_dots(kBare)), 0.0);
  EXPECT_TRUE(covered.empty());
}

// The slope of the ball changes by 0.11 over the 9 pixels that are interpolated. If it is right to a fraction
// of that, the error of the height is at most that times half of the width, 0.03 mm.
TEST(Highlights, ShinesNeitherThroughTheHeightsNorTheContact) {
  cv::Mat3b image = kTouched.clone();
  shine(image, kOnContact);
  shine(image, kOnGel);
  const SurfacePtr surface = surface_of(image);
  expect_undisturbed(*surface, *surface_of(kTouched));
  for (const cv::Point& place : kOnGel) EXPECT_EQ(surface->contact(place), 0) << place;
}

// The limit is the same as above, because the interpolated spot is as wide. The ring must also be found in a
// brighter light, from which it differs.
TEST(Highlights, ARingThatFillsNoChannelIsNeitherHeightNorContact) {
  for (const double brighter : {1.0, 1.2}) {
    const cv::Mat3b image(kTouched * brighter);
    const auto with_ring = pixel_map<cv::Vec3b>(kSensor, [&](int u, int v) {
      const double across_px = (std::hypot(u - 190, v - 120) - 32) / 2;
      return cv::Vec3d(image(v, u)) + cv::Vec3d::all(100 * std::exp(-0.5 * across_px * across_px));
    });
    expect_undisturbed(*surface_of(with_ring), *surface_of(image));
  }
}

// The limit is the same as above, because the interpolated spot is as wide.
TEST(DarkSpots, AHairIsNeitherHeightNorContact) {
  cv::Mat1f hair(kSensor, 0.0F);
  cv::polylines(hair, std::vector<std::vector<cv::Point>>{{{30, 60}, {120, 100}, {190, 125}, {290, 220}}},
                false, 1.0, 3);
  cv::GaussianBlur(hair, hair, {}, 1.0);
  expect_undisturbed(*surface_of(shaded(kTouched, cv::Mat1f(1.0F - 0.9F * hair))), *surface_of(kTouched));
}

// Returns a picture with one wrong value in a hundred, in any channel. With another seed other values are
// wrong; with the same seed the same pixels are, also in the background.
cv::Mat3b peppered(const cv::Mat3b& image, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  cv::Mat3b result = image.clone();
  for (cv::Vec3b& pixel : result)
    for (int c = 0; c < 3; ++c)
      if (random() % 100 == 0) pixel[c] = random() % 2 == 0 ? 0 : 255;
  return result;
}

TEST(WrongPixels, AreNotSeen) {
  const SurfacePtr undisturbed = surface_of(kTouched), surface = surface_of(peppered(kTouched, 5));
  // A replaced value is that of a neighbor and wrong by about two gray levels. So few of them hardly change a
  // height.
  EXPECT_LT(cv::norm(surface->height_mm, undisturbed->height_mm, cv::NORM_INF), 0.01);
  expect_undisturbed(*surface, *undisturbed);
  const SurfacePtr from_hot_background =
      SurfaceEstimator(linear_gel_model(), peppered(kBare, 5), {}).estimate(peppered(kTouched, 5));
  EXPECT_LT(cv::norm(from_hot_background->height_mm, undisturbed->height_mm, cv::NORM_INF), 0.01);
  EXPECT_EQ(surface_of(peppered(kBare, 6))->contact_pixels, 0);
}

TEST(PixelRepair, PassesOnAsItIsWhatHasNothingToRepair) {
  surface::detail::PixelRepair repair(kBare);
  for (const double noise : {0.0, 1.0, 6.0}) {
    const cv::Mat3b image = render(kBall, kPitchMm, noise, 4);
    EXPECT_EQ(repair.clean(image).data, image.data) << noise;
  }
  cv::Mat3b lit = kTouched.clone();
  lit(10, 10) = {255, 200,
                 100};  // one channel is full where a slope faces a lamp, and the others still tell it
  EXPECT_EQ(repair.clean(lit).data, lit.data);
  const cv::Mat3b dark_all_over(kBare * 0.4);
  EXPECT_EQ(repair.clean(dark_all_over).data, dark_all_over.data) << "it is the light; a touch must be seen";
}

}  // namespace
}  // namespace gelslam::test
