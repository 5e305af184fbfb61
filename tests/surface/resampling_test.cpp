#include "gelslam/surface/resampling.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../support/analytic_surface.hpp"

namespace gelslam {
namespace {

using namespace test;

TEST(Resampled, ShowsTheSamePlaceAtAnotherPitch) {
  View fine;
  fine.pixel_pitch_mm = 0.04;
  fine.contact_width_px = fine.contact_height_px = 80;
  const Pose pose = motion(3, 4, 20, 0, 0, 0.4);
  const SurfacePtr seen = touch(textured_plane(1), pose, fine), same = resampled(*seen, 0.0634);
  EXPECT_EQ(same->pixel_pitch_mm, 0.0634);
  View coarse;
  coarse.width_px = same->contact.cols;
  coarse.height_px = same->contact.rows;
  coarse.contact_width_px = coarse.contact_height_px = 80 * 0.04 / 0.0634;
  const SurfacePtr truth = touch(textured_plane(1), pose, coarse);
  EXPECT_NEAR(same->contact_pixels, truth->contact_pixels, 0.02 * truth->contact_pixels);
  cv::Mat both;
  cv::bitwise_and(same->contact, truth->contact, both);
  cv::erode(both, both, cv::Mat(), {-1, -1}, 2);
  EXPECT_LT(cv::norm(same->height_mm, truth->height_mm, cv::NORM_INF, both), 0.003);
  EXPECT_LT(cv::norm(same->curvature, truth->curvature, cv::NORM_L2, both) /
                cv::norm(truth->curvature, cv::NORM_L2, both),
            0.2);
}

}  // namespace
}  // namespace gelslam
