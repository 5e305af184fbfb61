#include "heights/contact_mask.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "heights/normals.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

constexpr double kDepthMm = 0.4;
constexpr double kRelaxationMm = 0.7;  // of the gel beside an object

double inside(double r_mm) { return std::cyl_bessel_i(0, r_mm / kRelaxationMm); }
double outside(double r_mm) { return std::cyl_bessel_k(0, r_mm / kRelaxationMm); }

/// Returns the heights of a gel whose depth is a function of the distance (mm) from column `center_u` of the
/// middle row.
template <typename Depth>
cv::Mat1f round_gel(double center_u, double pitch_mm, const Depth& depth_mm) {
  return pixel_map<float>(
      kSensor, [&](int u, int v) { return -depth_mm(pitch_mm * std::hypot(u - center_u, v - 119.5)); });
}

/// Returns the heights of a pressed ring that is 0.8 mm wide. Inside and outside of it the gel is draped like
/// a membrane.
cv::Mat1f ring(double inner_mm, double center_u) {
  const double outer_mm = inner_mm + 0.8;
  return round_gel(center_u, kPitchMm, [&](double r_mm) {
    return kDepthMm * (r_mm < inner_mm   ? inside(r_mm) / inside(inner_mm)
                       : r_mm > outer_mm ? outside(r_mm) / outside(outer_mm)
                                         : 1);
  });
}

cv::Mat1b deeper_than_half(const cv::Mat1f& height_mm) {
  cv::Mat1b mask;
  cv::compare(height_mm, -0.5 * kDepthMm, mask, cv::CMP_LT);
  return mask;
}

cv::Mat1b contact_of(const cv::Mat1f& height_mm, double pitch_mm = kPitchMm,
                     const HeightQuality& quality = {}) {
  cv::Mat1f gx, gy;
  cv::Sobel(height_mm, gx, CV_32F, 1, 0, 1, 0.5 / pitch_mm, 0, cv::BORDER_REPLICATE);
  cv::Sobel(height_mm, gy, CV_32F, 0, 1, 1, 0.5 / pitch_mm, 0, cv::BORDER_REPLICATE);
  cv::Mat1b contact;
  ContactDetector(pitch_mm).detect(height_mm, divergence(gx, gy), deeper_than_half(height_mm), quality,
                                   contact);
  return contact;
}

double radius_mm(const cv::Mat1b& contact, double pitch_mm) {
  return pitch_mm * std::sqrt(cv::countNonZero(contact) / CV_PI);
}

// A ball presses a membrane. The contact ends where the ball and the free gel have the same slope, at a known
// radius. The smoothing of the curvature may widen the contact by 0.2 mm.
TEST(ContactMask, EndsWhereTheGelLeavesABall) {
  for (const double pitch_mm : {0.0423, kPitchMm, 0.0845})
    for (const double ball_mm : {3.0, 5.0, 8.0})
      for (const double edge_mm : {0.8, 1.5, 2.2}) {
        const double slope = edge_mm / ball_mm,  // of the paraboloid at the edge
            edge_depth_mm =
                slope * kRelaxationMm * outside(edge_mm) / std::cyl_bessel_k(1, edge_mm / kRelaxationMm);
        const cv::Mat1f height_mm = round_gel(159.5, pitch_mm, [&](double r_mm) {
          return r_mm < edge_mm ? edge_depth_mm + (edge_mm * edge_mm - r_mm * r_mm) / (2 * ball_mm)
                                : edge_depth_mm * outside(r_mm) / outside(edge_mm);
        });
        EXPECT_NEAR(radius_mm(contact_of(height_mm, pitch_mm), pitch_mm), edge_mm, 0.2)
            << "pitch " << pitch_mm << ", ball " << ball_mm;
      }
}

// At the edge of a flat face the pressure is concentrated on a line, which smoothing widens by 0.2 to 0.4 mm.
// Without the curvature, the gel beside the face would count as contact over 1 mm or more.
TEST(ContactMask, HardlyDependsOnTheGelBesideAFlatFace) {
  const auto flat_face = [](double relaxation_mm) {
    return round_gel(159.5, kPitchMm, [=](double r_mm) {
      return kDepthMm * (r_mm < 2 ? 1
                                  : std::cyl_bessel_k(0, r_mm / relaxation_mm) /
                                        std::cyl_bessel_k(0, 2 / relaxation_mm));
    });
  };
  for (const double relaxation_mm : {0.35, 0.7, 0.9})
    EXPECT_NEAR(radius_mm(contact_of(flat_face(relaxation_mm)), kPitchMm), 2, 0.4) << relaxation_mm;
}

// Holes of up to 3.3 mm² are filled, which have a radius of 1.03 mm. Smoothing reduces the radius by up to
// 0.5 mm.
TEST(ContactMask, SmallHolesOfARingAreFilledLargeOnesStay) {
  for (const double inner_mm : {0.5, 0.8, 1.9, 2.5}) {
    const cv::Mat1b contact = contact_of(ring(inner_mm, 159.5));
    const int on_ring = 160 + static_cast<int>((inner_mm + 0.4) / kPitchMm);
    EXPECT_TRUE(contact(120, on_ring)) << inner_mm;
    EXPECT_EQ(contact(120, 160) != 0, inner_mm < 1) << inner_mm;
    EXPECT_FALSE(contact(120, 160 + static_cast<int>((inner_mm + 1.3) / kPitchMm))) << inner_mm;
  }
}

// Two bars are pressed in. The gel that is draped between them is not in contact.
TEST(ContactMask, EndsWhereTheGelHangsBetweenTwoCrests) {
  for (const double gap_mm : {1.0, 1.5}) {
    const cv::Mat1f height_mm = pixel_map<float>(kSensor, [&](int u, int v) {
      const double x_mm = kPitchMm * std::abs(u - 159.5) - gap_mm / 2, y_mm = kPitchMm * std::abs(v - 119.5);
      const double hanging =
                       std::cosh((x_mm + gap_mm / 2) / kRelaxationMm) / std::cosh(gap_mm / 2 / kRelaxationMm),
                   beside = std::exp(-std::max(0.0, x_mm - 0.8) / kRelaxationMm);
      return -kDepthMm * (x_mm < 0 ? hanging : beside) * std::exp(-std::max(0.0, y_mm - 4) / kRelaxationMm);
    });
    const cv::Mat1b contact = contact_of(height_mm);
    EXPECT_TRUE(contact(120, 160 + static_cast<int>((gap_mm / 2 + 0.4) / kPitchMm))) << gap_mm;
    EXPECT_FALSE(contact(120, 160)) << gap_mm;
  }
}

TEST(ContactMask, AHoleThatReachesThePicturesBorderStays) {
  const cv::Mat1b contact = contact_of(ring(1.2, 0));
  EXPECT_TRUE(contact(120, static_cast<int>(1.6 / kPitchMm)));
  EXPECT_FALSE(contact(120, 2));
}

// With a model of another sensor, the error of the heights is a fraction of the largest depth.
TEST(ContactMask, WhatIsNoDeeperThanTheErrorOfHeightsIsNoContact) {
  const cv::Mat1f height_mm = pixel_map<float>(kSensor, [](int u, int v) {
    const auto cap = [&](double at_u, double depth_mm) {
      const double r_mm = kPitchMm * std::hypot(u - at_u, v - 119.5);
      return depth_mm * std::max(0.0, 1 - r_mm * r_mm / 4);
    };
    return -cap(80, 1.0) - cap(240, 0.1);
  });
  const cv::Rect faint(190, 70, 100, 100);
  EXPECT_GT(cv::countNonZero(contact_of(height_mm)(faint)), 1000);
  EXPECT_EQ(cv::countNonZero(contact_of(height_mm, kPitchMm, {.slope_sigma_ratio = 4})(faint)), 0);
  EXPECT_EQ(cv::countNonZero(contact_of(height_mm, kPitchMm, {.bare_scatter_mm = 0.03F})(faint)), 0);
}

TEST(ContactMask, WithoutBareGelWhatHasChangedIsContact) {
  const cv::Mat1b contact = contact_of(ring(2.5, 159.5), kPitchMm, {.bare_gel_is_seen = false});
  const cv::Mat1b changed = deeper_than_half(ring(2.5, 159.5));
  cv::Mat1b differs;
  cv::compare(contact, changed, differs, cv::CMP_NE);
  EXPECT_LT(cv::countNonZero(differs), 0.01 * cv::countNonZero(changed));
}

}  // namespace
}  // namespace gelslam::test
