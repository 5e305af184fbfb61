#include "heights/contact_mask.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "photometry/blocks.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

constexpr double kPitchMm = 0.0634, kDepthMm = 0.4;
const cv::Size kSensor(320, 240);

/// A pressed ring, 0.8 mm wide, around the picture's middle; the gel within and around it hangs as a membrane
/// does.
cv::Mat1f ring(double inner_mm) {
  const double outer_mm = inner_mm + 0.8;
  cv::Mat1f height_mm(kSensor);
  for (int v = 0; v < kSensor.height; ++v)
    for (int u = 0; u < kSensor.width; ++u) {
      const double r = kPitchMm * std::hypot(u - 159.5, v - 119.5);
      double share = 1;
      if (r < inner_mm)
        share = std::cyl_bessel_i(0, r / kRimLengthMm) / std::cyl_bessel_i(0, inner_mm / kRimLengthMm);
      if (r > outer_mm)
        share = std::cyl_bessel_k(0, r / kRimLengthMm) / std::cyl_bessel_k(0, outer_mm / kRimLengthMm);
      height_mm(v, u) = static_cast<float>(-kDepthMm * share);
    }
  return height_mm;
}

cv::Mat1b contact_of(const cv::Mat1f& height_mm) {
  cv::Mat1b contact;
  ContactDetector(kSensor, {})
      .detect(height_mm, kPitchMm, 0.002F, cv::Mat3f(block_grid(kSensor), cv::Vec3f(40, 0, 0)), contact);
  return contact;
}

TEST(ContactMask, AFieldThatAPressedRingEnclosesIsTouchedUnlessItIsLarge) {
  for (const double inner_mm : {0.6, 0.9, 1.2, 2.1}) {
    const cv::Mat1b contact = contact_of(ring(inner_mm));
    const int on_ring = 160 + static_cast<int>((inner_mm + 0.4) / kPitchMm);
    EXPECT_TRUE(contact(120, on_ring)) << inner_mm;
    // A hole of 40 x 40 pixels has a radius of 1.43 mm; pressure, blurred, narrows it by up to 0.5.
    EXPECT_EQ(contact(120, 160) != 0, inner_mm < 1.43) << inner_mm;
    EXPECT_FALSE(contact(120, 160 + static_cast<int>((inner_mm + 1.8) / kPitchMm))) << inner_mm;
  }
}

TEST(ContactMask, AFieldThatIsOpenToOneSideIsNotTouched) {
  cv::Mat1f height_mm = ring(0.9);
  height_mm(cv::Rect(160, 106, 160, 28)) = 0.0F;  // 1.8 mm wide, more than what is closed
  const cv::Mat1b contact = contact_of(height_mm);
  EXPECT_TRUE(contact(120, 160 - static_cast<int>(1.3 / kPitchMm)));
  EXPECT_FALSE(contact(120, 158));
}

}  // namespace
}  // namespace gelslam::test
