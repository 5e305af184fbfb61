// Compares the bare gel with how it looked when the model was calibrated, to warn of a changed light, another
// gel or sensor, or exchanged colors or sides. This comparison is not in the papers, and no surface depends
// on it. The robust fit of gains and offsets in light.cpp explains what the light has changed; its residual
// is taken for a change of the gel.

#include "gelslam/surface/background_drift.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <tuple>
#include <utility>
#include <vector>

#include "gelslam/core/median.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/model_file.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

// All levels are gray levels, root mean squares over the three channels.
// The program warns of a change of light beyond this limit. Within it, the surface stage compensates for the
// change, and models were found to stay accurate.
constexpr double kLightLimitLevels = 12.0;
// The program warns of a change of the gel if the residual exceeds the first limit on average over the gel,
// or the second at one place. Two sensors of one kind differ by 10 or more on average, the same gel weeks
// later by less than 2. The first limit also decides whether a press belongs to a background
// (shows_same_gel): the untouched parts of 228 presses of three sensors differ by at most 2.9 from their own
// background, and by at least 5.6 from that of another sensor.
constexpr double kGelLimitLevels = 4.0, kCellLimitLevels = 20.0;
// Colors or sides are reported as exchanged if exchanging them back leaves less than this fraction of the
// change of the gel.
constexpr double kSwappedShare = 0.5;

/// Returns two parts of a sentence for the user: what differs, and what to do about it.
std::pair<std::string, std::string> words_for(const BackgroundDrift& drift) {
  if (!drift.exchanged.empty())
    return {
        drift.exchanged + " are swapped",
        " since the calibration: the program that takes the pictures has changed their order; take them as "
        "for the calibration"};
  if (drift.gel_changed)
    return {
        fmt::format("the gel looks different ({:.1f} gray levels that no change of light explains, {:.0f} at "
                    "the worst place): another gel or sensor, something on it, dirt or wear",
                    drift.gel_change_levels, drift.worst_cell_levels),
        "; clean it, and calibrate again if that does not help"};
  if (drift.light_changed)
    return {
        fmt::format(
            "the light has changed by {:.0f} gray levels (blue {:+.0f} %, green {:+.0f} %, red {:+.0f} %)",
            drift.light_change_levels, 100.0 * (drift.light_gain[0] - 1.0),
            100.0 * (drift.light_gain[1] - 1.0), 100.0 * (drift.light_gain[2] - 1.0)),
        ": check the exposure and lamps, or calibrate again"};
  return {fmt::format("gel and light are as they were (light {:.1f}, gel {:.1f} gray levels)",
                      drift.light_change_levels, drift.gel_change_levels),
          ""};
}

cv::Mat3f flipped(const cv::Mat3f& cells, int code) {
  cv::Mat3f result;
  cv::flip(cells, result, code);
  return result;
}

/// Computes all numbers of a BackgroundDrift, but neither its sentences nor `exchanged`.
BackgroundDrift compare(const cv::Mat3f& then, const cv::Mat3f& now) {
  const auto [gain, offset] = follow_light(then, now);
  BackgroundDrift drift;
  drift.light_gain = gain;
  const cv::Scalar mean = cv::mean(then);
  double light = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double change = (gain[c] - 1.0) * mean[static_cast<int>(c)] + offset[c];
    light += change * change / 3.0;
  }
  drift.light_change_levels = std::sqrt(light);
  double total = 0.0, worst = 0.0;
  for (int row = 0; row < then.rows; ++row)
    for (int column = 0; column < then.cols; ++column) {
      double squared = 0.0;
      for (int channel = 0; channel < 3; ++channel) {
        const auto c = static_cast<std::size_t>(channel);
        const double residual = static_cast<double>(now(row, column)[channel]) -
                                gain[c] * static_cast<double>(then(row, column)[channel]) - offset[c];
        squared += residual * residual / 3.0;
      }
      total += squared;
      worst = std::max(worst, squared);
    }
  drift.gel_change_levels = std::sqrt(total / static_cast<double>(then.total()));
  drift.worst_cell_levels = std::sqrt(worst);
  drift.gel_changed = drift.gel_change_levels > kGelLimitLevels || drift.worst_cell_levels > kCellLimitLevels;
  drift.light_changed = drift.light_change_levels > kLightLimitLevels;
  return drift;
}

}  // namespace

BackgroundDrift measure_drift(const cv::Mat3f& then, const cv::Mat3f& now) {
  BackgroundDrift drift = compare(then, now);
  double least = kSwappedShare * drift.gel_change_levels;
  cv::Mat3f swapped;
  cv::cvtColor(now, swapped, cv::COLOR_BGR2RGB);
  const std::pair<const char*, cv::Mat3f> others[] = {
      {"red and blue", swapped},
      {"left and right", flipped(now, 1)},
      {"top and bottom", flipped(now, 0)},
      {"left and right, and top and bottom,", flipped(now, -1)}};
  for (const auto& [what, cells] : others) {
    const double levels = compare(then, cells).gel_change_levels;
    if (!drift.gel_changed || levels >= least) continue;
    least = levels;
    drift.exchanged = what;
  }
  std::string remedy;
  std::tie(drift.difference, remedy) = words_for(drift);
  drift.words = drift.difference + remedy;
  return drift;
}

cv::Mat3b in_light_of(const cv::Mat3b& background, const cv::Mat3b& picture) {
  LightTracker tracker(average_blocks(background), true);
  cv::Mat3f levels;
  picture.convertTo(levels, CV_32F);
  to_background_light(tracker.update(average_blocks(picture), {}), levels);
  cv::Mat3b result;
  levels.convertTo(result, CV_8U);
  return result;
}

bool shows_same_gel(const cv::Mat3b& followed, const cv::Mat3b& background) {
  const cv::Mat3f seen = background_cells(followed), expected = background_cells(background);
  std::vector<double> levels;
  std::transform(seen.begin(), seen.end(), expected.begin(), std::back_inserter(levels),
                 [](const cv::Vec3f& a, const cv::Vec3f& b) { return cv::norm(a, b); });
  return median(levels) <= kGelLimitLevels;
}

}  // namespace gelslam
