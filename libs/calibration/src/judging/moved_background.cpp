#include <fmt/core.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMaxCompared = 32;            // presses: in the mean of so many no contact is left
constexpr double kNoisePx = 1.0, kTexturePx = 6.0;  // what is broader is the lamps' light
// Four sensors: a peak of 0.7 or more, and presses up to 0.5 px beside their background.
constexpr double kMinCorrelation = 0.3;
// A model of presses 3 px beside it reads slopes 0.7 % too steep, one of presses 10 px beside it 2.4 %.
constexpr double kMaxMovedPx = 4.0;

/// Dust, scratches and grain, which move with the gel.
cv::Mat1f fine_texture(const cv::Mat3b& bgr) {
  cv::Mat1b gray;
  cv::Mat1f texture, broad;
  cv::cvtColor(bgr, gray, cv::COLOR_BGR2GRAY);
  gray.convertTo(texture, CV_32F);
  cv::GaussianBlur(texture, broad, cv::Size(), kTexturePx);
  cv::GaussianBlur(texture, texture, cv::Size(), kNoisePx);
  cv::subtract(texture, broad, texture);
  return texture;
}

/// The mean of presses from all over the set; empty when none can be read.
cv::Mat3b mean_press(const PressSet& set) {
  std::vector<cv::Mat3b> pictures;
  for (const CalibrationPress& press : set.presses)
    if (press.problem.empty()) pictures.push_back(press.bgr);
  const std::size_t every = std::max<std::size_t>(1, pictures.size() / kMaxCompared);
  std::vector<cv::Mat3b> some;
  for (std::size_t k = 0; k < pictures.size(); k += every) some.push_back(pictures[k]);
  return some.empty() ? cv::Mat3b() : mean_image(some);
}

}  // namespace

void require_unmoved_background(const PressSet& set) {
  const cv::Mat3b mean = mean_press(set);
  if (mean.empty()) return;
  cv::Mat1f window;
  cv::createHanningWindow(window, mean.size(), CV_32F);
  double correlation = 0.0;
  const cv::Point2d moved =
      cv::phaseCorrelate(fine_texture(set.background), fine_texture(mean), window, &correlation);
  if (correlation < kMinCorrelation || cv::norm(moved) <= kMaxMovedPx) return;
  throw Error(fmt::format(
      "{}: the gel of the presses lies {:.1f} px beside that of background.png (x {:+.1f}, y {:+.1f}): the "
      "camera or the gel has moved between them; take background.png again as the presses were taken, or all "
      "pictures again",
      quoted(set.folder), cv::norm(moved), moved.x, moved.y));
}

}  // namespace gelslam
