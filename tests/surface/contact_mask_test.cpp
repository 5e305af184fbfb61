#include "heights/contact_mask.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "linear_gel.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

constexpr double kDepthMm = 0.4;

/// A pressed ring, 0.8 mm wide, around column `center_u`; the gel within and around it hangs as a membrane
/// does.
cv::Mat1f ring(double inner_mm, double center_u) {
  const double outer_mm = inner_mm + 0.8;
  const auto inside = [](double r_mm) { return std::cyl_bessel_i(0, r_mm / kRimLengthMm); };
  const auto outside = [](double r_mm) { return std::cyl_bessel_k(0, r_mm / kRimLengthMm); };
  return pixel_map<float>(kSensor, [&](int u, int v) {
    const double r_mm = kPitchMm * std::hypot(u - center_u, v - 119.5);
    return -kDepthMm * (r_mm < inner_mm   ? inside(r_mm) / inside(inner_mm)
                        : r_mm > outer_mm ? outside(r_mm) / outside(outer_mm)
                                          : 1);
  });
}

cv::Mat1b contact_of(const cv::Mat1f& height_mm) {
  cv::Mat1b contact;
  ContactDetector(kSensor, {})
      .detect(height_mm, kPitchMm, 0.002F, cv::Mat3f(block_grid(kSensor), cv::Vec3f(40, 0, 0)), contact);
  return contact;
}

// Pressure, which is blurred, narrows a hole by up to 0.5 mm. Of smaller rings than these it leaves none; the
// largest hole to be filled, 40 x 40 pixels, has a radius of 1.43 mm.
TEST(ContactMask, SmallHolesOfARingAreFilledLargeOnesStay) {
  for (const double inner_mm : {1.1, 1.2, 1.5, 2.1}) {
    const cv::Mat1b contact = contact_of(ring(inner_mm, 159.5));
    const int on_ring = 160 + static_cast<int>((inner_mm + 0.4) / kPitchMm);
    EXPECT_TRUE(contact(120, on_ring)) << inner_mm;
    EXPECT_EQ(contact(120, 160) != 0, inner_mm < 2) << inner_mm;
    EXPECT_FALSE(contact(120, 160 + static_cast<int>((inner_mm + 1.8) / kPitchMm))) << inner_mm;
  }
}

TEST(ContactMask, AHoleThatReachesThePicturesBorderStays) {
  const cv::Mat1b contact = contact_of(ring(1.2, 0));
  EXPECT_TRUE(contact(120, static_cast<int>(1.6 / kPitchMm)));
  EXPECT_FALSE(contact(120, 2));
}

}  // namespace
}  // namespace gelslam::test
