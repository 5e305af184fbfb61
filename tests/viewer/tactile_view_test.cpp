#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "live/live_window.hpp"

namespace gelslam::viewer::detail {
namespace {

std::shared_ptr<Surface> surface_with_disc(int radius_px) {
  auto surface = std::make_shared<Surface>();
  surface->contact = cv::Mat1b(120, 160, uchar{0});
  cv::circle(surface->contact, {80, 60}, radius_px, 255, cv::FILLED);
  surface->normals = cv::Mat3f(120, 160, cv::Vec3f(0.6F, 0, 0.8F));
  return surface;
}

double distance_to(const cv::Vec3b& a, const cv::Vec3b& b) { return cv::norm(cv::Vec3d(a) - cv::Vec3d(b)); }

TEST(TactilePicture, OutlinesTheContactWhereItIs) {
  const cv::Vec3b ink(146, 211, 82);  // green
  const cv::Mat3b picture =
      tactile_picture(cv::Mat3b(120, 160, cv::Vec3b(90, 100, 110)), surface_with_disc(40).get());
  ASSERT_EQ(picture.size(), cv::Size(640, 480));
  int inked = 0;
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      if (distance_to(picture(v, u), ink) > 60) continue;
      ++inked;
      // The mask is drawn at four times its size: its border has radius 160, the line a few pixels.
      EXPECT_NEAR(std::hypot(u - 321.5, v - 241.5), 160, 8);
    }
  EXPECT_GT(inked, 2 * M_PI * 160 * 0.8) << "once around, and at least a pixel wide";
  EXPECT_EQ(picture(240, 320), cv::Vec3b(90, 100, 110)) << "the inside stays as it is";
}

TEST(NormalPicture, ShowsDirectionsAsColors) {
  const auto surface = surface_with_disc(40);
  const cv::Mat3b picture = normal_picture(*surface);
  const cv::Vec3b middle = picture(240, 320);
  EXPECT_NEAR(middle[2], 127.5 * 1.6, 1.5) << "x is red";
  EXPECT_NEAR(middle[1], 127.5, 1.5) << "y is green";
  EXPECT_NEAR(middle[0], 127.5 * 1.8, 1.5) << "z is blue";
  EXPECT_LT(cv::norm(cv::Vec3d(picture(2, 2))), 0.6 * cv::norm(cv::Vec3d(middle)))
      << "faded outside the contact";
  EXPECT_TRUE(normal_picture(Surface()).empty());
}

}  // namespace
}  // namespace gelslam::viewer::detail
