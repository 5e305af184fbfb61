// A simulated hand that presses a ball: what the log shows, and what its truth says.

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <set>
#include <vector>

#include "gelslam/simulation/data_folder.hpp"

namespace gelslam {
namespace {

PressLogSpec few() {
  PressLogSpec spec;
  spec.presses = 4;
  spec.background_frames = 5;
  return spec;
}

double change(const cv::Mat3b& a, const cv::Mat3b& b, const cv::Point2d& place) {
  const cv::Rect around =
      cv::Rect(cvRound(place.x) - 40, cvRound(place.y) - 40, 80, 80) & cv::Rect({0, 0}, a.size());
  return cv::norm(a(around), b(around), cv::NORM_L1) / (3.0 * around.area());
}

TEST(PressLog, TouchesTheGelWhenAndWhereItSays) {
  std::vector<cv::Mat3b> frames;
  const auto touches =
      simulate_press_log(few(), [&](const cv::Mat3b& bgr) { frames.push_back(bgr.clone()); });
  ASSERT_EQ(touches.size(), 4U);
  const double noise = change(frames[0], frames[1], {160, 120});
  for (const SimulatedTouch& touch : touches) {
    const auto first = static_cast<std::size_t>(touch.first_frame),
               last = static_cast<std::size_t>(touch.last_frame);
    ASSERT_LT(last + 5, frames.size());
    EXPECT_GT(change(frames[first], frames[0], touch.center_px), 3 * noise);
    EXPECT_LT(change(frames[last + 5], frames[0], touch.center_px), 1.2 * noise);
    EXPECT_LT(change(frames[first], frames[last], touch.center_px), 1.2 * noise) << "held still";
  }
}

TEST(PressLog, CoversTheGelAndIsDeterministic) {
  PressLogSpec spec = few();
  spec.presses = 9;
  spec.optics.noise_gain = 0;
  cv::Mat3b last, again;
  const auto touches = simulate_press_log(spec, [&](const cv::Mat3b& bgr) { last = bgr.clone(); });
  std::set<int> ninths;
  for (const SimulatedTouch& touch : touches)
    ninths.insert(3 * static_cast<int>(touch.center_px.y / 80) + static_cast<int>(touch.center_px.x / 106.7));
  EXPECT_EQ(ninths.size(), 9U);
  simulate_press_log(spec, [&](const cv::Mat3b& bgr) { again = bgr.clone(); });
  EXPECT_EQ(cv::norm(last, again, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace gelslam
