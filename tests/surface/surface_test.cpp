#include "gelslam/surface/surface.hpp"

#include <gtest/gtest.h>

#include "gelslam/surface/contact_overlap.hpp"

namespace gelslam {
namespace {

/// Returns a surface whose right half is in contact, 0.3 mm deep.
Surface half_touched() {
  Surface surface;
  surface.contact = cv::Mat1b(240, 320, uchar(0));
  surface.contact.colRange(160, 320) = 255;
  surface.height_mm = cv::Mat1f(240, 320, -0.3F);
  return surface;
}

TEST(ContactPoints, LieInTheContactAndAreShown) {
  const Surface surface = half_touched();
  const auto points = coarse_contact_points_mm(surface);
  EXPECT_EQ(points.size(), 20U * 30U);
  for (const Eigen::Vector3d& p : points) {
    EXPECT_GT(p.x(), 0);
    EXPECT_FLOAT_EQ(static_cast<float>(p.z()), -0.3F);
    EXPECT_TRUE(shows(surface, p));
    EXPECT_FALSE(shows(surface, {-p.x(), p.y(), p.z()})) << "bare gel";
    EXPECT_FALSE(shows(surface, {p.x(), p.y(), p.z() - 0.6})) << "the object's other side";
  }
}

TEST(ContactOverlap, IsTheShareOfPointsThatTheOtherContactShows) {
  const Surface surface = half_touched();
  const auto points = coarse_contact_points_mm(surface);
  const double width_mm = 160 * surface.pixel_pitch_mm;
  Pose moved = Pose::Identity();
  EXPECT_DOUBLE_EQ(shown_share(points, surface, moved), 1.0);
  moved.translation().x() = width_mm / 2;
  EXPECT_DOUBLE_EQ(shown_share(points, surface, moved), 0.5);
  EXPECT_DOUBLE_EQ(shown_share({}, surface, moved), 0.0);
}

}  // namespace

}  // namespace gelslam
