#include "gelslam/surface/background.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

// Motion: the color of 12x12 pixels against their mean over the frames. In clean logs only single blocks
// differ by 3 gray levels (1.5 between means of half of the frames) and by 7 times the lower quartile; a
// contact of 500 pixels covers 30.
constexpr float kMovingLevels = 3.0F;
constexpr float kMotionQuartiles = 7.0F;
constexpr int kMinMovingBlocks = 25;

constexpr double kSettledGainError = 0.01;  // lamps flicker by less

// Imprint: halfway between what clean backgrounds of four sensors show (slope 0.08, curvature 0.015 per
// pixel) and what the shallowest of their ball presses do (0.14, 0.024).
constexpr double kImprintCurvature = 0.0195;
constexpr int kBorderPx = 3 * kBlockPx;  // the model extrapolates there

float percentile(const cv::Mat1f& values, double share) {
  return quantile(std::vector<float>(values.begin(), values.end()), share);
}

cv::Mat1f inside_border(const cv::Mat1f& map) {
  return map(cv::Rect(kBorderPx, kBorderPx, map.cols - 2 * kBorderPx, map.rows - 2 * kBorderPx)).clone();
}

// The map without its smooth part.
cv::Mat1f local_part(const cv::Mat1f& map, double smooth_px, double broad_px) {
  cv::Mat1f smooth, broad, local;
  cv::GaussianBlur(map, smooth, cv::Size(), smooth_px, smooth_px, cv::BORDER_REPLICATE);
  cv::GaussianBlur(smooth, broad, cv::Size(), broad_px, broad_px, cv::BORDER_REPLICATE);
  cv::subtract(smooth, broad, local);
  return local;
}

// Percentage of the image where two pictures differ, apart from their light; 0 when it is insignificant.
int differing_percent(const cv::Mat3f& blocks, const cv::Mat3f& reference_blocks, float least_levels) {
  LightTracker tracker(reference_blocks);
  cv::Mat3f difference = blocks.clone();
  to_background_light(tracker.update(blocks, cv::Mat1b()), difference);
  cv::subtract(difference, reference_blocks, difference);
  cv::blur(difference, difference, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  cv::Mat1f length(difference.size());
  for (int row = 0; row < length.rows; ++row) {
    for (int column = 0; column < length.cols; ++column) {
      length(row, column) = static_cast<float>(cv::norm(difference(row, column)));
    }
  }
  const float limit = std::max(least_levels, kMotionQuartiles * percentile(length, 0.25));
  const int count = cv::countNonZero(length > limit);
  return count < kMinMovingBlocks ? 0 : std::max(1, 100 * count / static_cast<int>(length.total()));
}

std::string find_motion(const std::vector<cv::Mat3b>& frames, const cv::Mat3b& mean) {
  const cv::Mat3f mean_blocks = average_blocks(mean);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int percent = differing_percent(average_blocks(frames[i]), mean_blocks, kMovingLevels);
    if (percent == 0) continue;
    return "something moves on the gel: frame " + std::to_string(i + 1) + " of " +
           std::to_string(frames.size()) + " differs from the others over " + std::to_string(percent) +
           " % of the image";
  }
  if (frames.size() < 2) return {};
  const auto middle = frames.begin() + static_cast<std::ptrdiff_t>(frames.size() / 2);
  const int percent =
      differing_percent(average_blocks(mean_image({frames.begin(), middle})),
                        average_blocks(mean_image({middle, frames.end()})), kMovingLevels / 2);
  if (percent == 0) return {};
  return "something moves slowly on the gel: the first and the second half of the frames differ over " +
         std::to_string(percent) + " % of the image";
}

std::string find_imprint(const cv::Mat3b& mean, const GradientModel& model, double pixel_pitch_mm) {
  if (std::min(mean.rows, mean.cols) <= 4 * kBorderPx) return {};
  const GradientMap gradient(model, mean);
  cv::Mat1f slope;
  cv::magnitude(local_part(gradient.background_gx(), 3.0, 16.0),
                local_part(gradient.background_gy(), 3.0, 16.0), slope);
  PoissonSolver poisson(mean.size());
  const cv::Mat1f height = poisson.pixels(poisson.solve(gradient.background_gx(), gradient.background_gy()));
  cv::Mat1f curvature;
  cv::GaussianBlur(divergence(gradient.background_gx(), gradient.background_gy()), curvature, cv::Size(), 4.0,
                   4.0, cv::BORDER_REPLICATE);
  const double slope_99 = percentile(inside_border(slope), 0.99);
  const double curvature_99 = percentile(inside_border(curvature), 0.995);
  if (slope_99 < kBareSlope && curvature_99 < kImprintCurvature) return {};
  const double depth_mm =
      -pixel_pitch_mm * static_cast<double>(percentile(inside_border(local_part(height, 1.0, 32.0)), 0.005));
  return fmt::format("the gel already shows an imprint, about {:.1f} mm deep (local slope {:.2f})", depth_mm,
                     slope_99);
}

}  // namespace

EvenLight follow_light(const cv::Mat3f& then, const cv::Mat3f& now) {
  const Light light = LightTracker(then).update(now, {});
  EvenLight result;
  for (std::size_t c = 0; c < 3; ++c) {
    result.gain[c] = light.channels[c][0];
    result.offset[c] = light.channels[c][1];
  }
  return result;
}

cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images) {
  if (images.empty()) throw Error("no background images: need at least one frame without contact");
  cv::Mat3d sum(images.front().size(), cv::Vec3d::all(0.0));
  for (const cv::Mat3b& image : images) {
    if (image.size() != sum.size()) throw Error("background images differ in size");
    cv::accumulate(image, sum);
  }
  cv::Mat3b mean;
  sum.convertTo(mean, CV_8U, 1.0 / static_cast<double>(images.size()));
  return mean;
}

cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames) {
  if (frames.empty()) return mean_image(frames);
  const cv::Scalar last = cv::mean(frames.back());
  std::vector<cv::Mat3b> alike;
  for (const cv::Mat3b& frame : frames) {
    const cv::Scalar brightness = cv::mean(frame);
    cv::Scalar gain;
    bool is_settled = true;
    for (int channel = 0; channel < 3; ++channel) {
      gain[channel] = last[channel] / std::max(brightness[channel], 1.0);
      is_settled = is_settled && std::abs(gain[channel] - 1.0) < kSettledGainError;
    }
    cv::Mat3b brought;
    if (!is_settled) cv::multiply(frame, gain, brought);
    alike.push_back(is_settled ? frame : brought);
  }
  return mean_image(alike);
}

BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options, const std::string& device_name) {
  const cv::Mat3b mean = background_image(frames);
  BackgroundCheck check;
  const auto markers = find_marker_dots(mean);
  if (markers && !markers->are_readable()) {
    check.markers = true;
    check.reason = markers->sentence();
    return check;
  }
  check.reason = find_motion(frames, mean);
  check.contact = !check.reason.empty();
  if (check.contact) return check;
  const cv::Mat3b bare = MarkerFiller(mean).background();
  const std::string imprint = find_imprint(bare, model, options.pixel_pitch_mm);
  check.contact = !imprint.empty();
  if (check.contact) check.reason = judge_orientation(bare, device_name);
  check.turned = !check.reason.empty();
  append_sentence(check.reason, imprint);
  return check;
}

}  // namespace gelslam
