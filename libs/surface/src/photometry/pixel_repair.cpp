#include "photometry/pixel_repair.hpp"

#include <algorithm>
#include <cstdint>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/background.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// A value is wrong if it differs from the median of its 3x3 neighborhood by more than this many gray levels.
// Neighboring pixels of a gel differ by less than 10, and by up to 20 in strong noise. In a dithered picture
// they can differ by 60, and replacing values by the median would bias it. Therefore values are replaced only
// in pictures where enough values (one in kWrongValueIn) are outliers by three times this limit. Fewer wrong
// values are left to the robust weights of later stages.
constexpr int kWrongLevels = 35;
constexpr int kWrongValueIn = 500;

// A pixel is dark if all its channels are below this fraction of the background, and below kInkShare of it on
// a gel with printed dots. Real presses do not fall below 0.74.
constexpr double kDarkShare = 0.5;
constexpr double kInkShare = 0.65;
// Spots are dilated by this many pixels, over which lens and JPEG spread them. On real presses the slopes
// between printed dots are as accurate with 4 pixels, but too flat with 2.
constexpr int kSpreadPx = 3;
// The number of relaxation steps that suffices for a dot with a radius of ten pixels.
constexpr int kSmoothRounds = 20;
// A pixel is bright if all its channels exceed the background by more than this many gray levels. A slope
// cannot do that, because it darkens some colors while it brightens others. Real presses reach 30.
constexpr int kMaxBrighter = 35;
// Where a channel of the background is below this gray level, no lamp shines and pixels cannot become dark.
constexpr double kUnlitLevel = 10;
// If more than one in this many pixels is dark, or bright, the light has changed, and they are not spots.
constexpr int kOtherLightIn = 8;

/// Counts the values of a row that are more than `levels` above or below both neighbors of the same channel.
GELSLAM_CLONES int count_outliers(const unsigned char* value, int count, unsigned char levels) {
  int found = 0;
  for (int i = 3; i < count - 3; ++i) {
    const unsigned char low = std::min(value[i - 3], value[i + 3]),
                        high = std::max(value[i - 3], value[i + 3]);
    const auto above = static_cast<unsigned char>(std::max(value[i], high) - high);
    const auto below = static_cast<unsigned char>(low - std::min(value[i], low));
    found += std::max(above, below) > levels;
  }
  return found;
}

/// Returns whether so many values are wrong that they have to be replaced, judged by every fourth row.
bool has_wrong_values(const cv::Mat3b& bgr) {
  std::int64_t found = 0;
  for (int v = 0; v < bgr.rows; v += kBlockPx)
    found += count_outliers(bgr.ptr<unsigned char>(v), 3 * bgr.cols, 3 * kWrongLevels);
  return found * kBlockPx * kWrongValueIn > 3 * static_cast<std::int64_t>(bgr.total());
}

// The following tests look at the three values from index `i` on. These are a pixel's channels where `i` is a
// multiple of 3. may_show_spots() tries every `i`, so that the compiler can vectorize its loop; it may
// therefore find spots where there are none, but misses none.
bool is_dark(const unsigned char* value, const unsigned char* below, int i) {
  return (value[i] < below[i]) & (value[i + 1] < below[i + 1]) & (value[i + 2] < below[i + 2]);
}
bool may_be_bright(const unsigned char* value, const unsigned char* above, int i) {
  return (value[i] > above[i]) & (value[i + 1] > above[i + 1]) & (value[i + 2] > above[i + 2]);
}
bool is_bright(const cv::Vec3b& color, const cv::Vec3b& background, const cv::Vec3f& gain) {
  for (int c = 0; c < 3; ++c)
    if (color[c] <= gain[c] * background[c] + kMaxBrighter) return false;
  return true;
}
bool is_full(const unsigned char* value, int i) {
  const bool a = value[i] >= kFullLevel, b = value[i + 1] >= kFullLevel, c = value[i + 2] >= kFullLevel;
  return (a & b) | (b & c) | (c & a);
}

/// Returns false only if no pixel of a row is dark, bright or saturated.
GELSLAM_CLONES bool may_show_spots(const unsigned char* value, const unsigned char* below,
                                   const unsigned char* above, int count) {
  unsigned char found = 0;
  for (int i = 0; i + 2 < count; ++i) {
    const unsigned char seen = is_dark(value, below, i) | may_be_bright(value, above, i) | is_full(value, i);
    found |= seen;
  }
  return found != 0;
}

}  // namespace

void spread_spots(const cv::Mat1b& spots, cv::Mat1b& spread) {
  constexpr int side = 2 * kSpreadPx + 1;
  cv::dilate(spots, spread, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
}

PixelRepair::PixelRepair(const cv::Mat3b& background) {
  background_ = replace_wrong_values(background).clone();
  const auto markers = find_marker_dots(background_);
  if (markers) fill_background(markers->mask);
  background_.convertTo(dark_below_, CV_8U, markers ? kInkShare : kDarkShare);
  cv::add(background_, cv::Scalar::all(kMaxBrighter), bright_above_);
  for (cv::Vec3b& dark : dark_below_) {
    const bool is_lit = *std::min_element(dark.val, dark.val + 3) >= kUnlitLevel;
    dark = is_lit ? dark + cv::Vec3b::all(1) : cv::Vec3b();
  }
}

void PixelRepair::fill_background(const cv::Mat1b& dots) {
  dots_ = dots;
  readable_ = (dots == 0) & 1;
  const cv::Mat3b seen = background_;
  background_ = cv::Mat3b(seen.size());
  background_.setTo(cv::mean(seen, readable_));  // stays where no gel is near
  constexpr int thoroughly = 10 * kSmoothRounds;
  background_ = fill_spots(seen, thoroughly).clone();
}

const cv::Mat3b& PixelRepair::clean(const cv::Mat3b& bgr) {
  covered_.release();
  const cv::Mat3b& whole = replace_wrong_values(bgr);
  if (!find_spots(whole)) return whole;
  covered_ = readable_ == 0;
  return fill_spots(whole, dots_.empty() ? 0 : kSmoothRounds);
}

const cv::Mat3b& PixelRepair::replace_wrong_values(const cv::Mat3b& bgr) {
  if (!has_wrong_values(bgr)) return bgr;
  cv::medianBlur(bgr, median_, 3);
  cv::absdiff(bgr, median_, median_difference_);
  for (int v = 0; v < bgr.rows; ++v) {
    const unsigned char* seen = bgr.ptr<unsigned char>(v);
    const unsigned char* difference = median_difference_.ptr<unsigned char>(v);
    unsigned char* value = median_.ptr<unsigned char>(v);
    for (int i = 0; i < 3 * bgr.cols; ++i)
      if (difference[i] <= kWrongLevels) value[i] = seen[i];
  }
  return median_;
}

/// Returns for each channel the median ratio of picture to background over every 64th pixel, but at least 1.
cv::Vec3f PixelRepair::gain_of_light(const cv::Mat3b& bgr) const {
  cv::Vec3f gain;
  std::vector<float> ratios;
  for (int c = 0; c < 3; ++c) {
    ratios.clear();
    for (int v = 0; v < bgr.rows; v += 8)
      for (int u = 0; u < bgr.cols; u += 8)
        ratios.push_back(static_cast<float>(bgr(v, u)[c]) /
                         std::max(static_cast<float>(background_(v, u)[c]), 1.0F));
    gain[c] = std::max(1.0F, quantile_in_place(ratios, 0.5));
  }
  return gain;
}

/// Finds the spots of a picture and computes readable_. Returns false if there are none.
bool PixelRepair::find_spots(const cv::Mat3b& bgr) {
  std::vector<int> rows;
  for (int v = 0; v < bgr.rows; ++v)
    if (may_show_spots(bgr[v]->val, dark_below_[v]->val, bright_above_[v]->val, 3 * bgr.cols))
      rows.push_back(v);
  if (rows.empty() && dots_.empty()) return false;
  spots_ = cv::Mat1b::zeros(bgr.size());
  dark_ = cv::Mat1b::zeros(bgr.size());
  bright_ = cv::Mat1b::zeros(bgr.size());
  const cv::Vec3f gain = gain_of_light(bgr);
  for (const int v : rows)
    for (int u = 0; u < bgr.cols; ++u) {
      const unsigned char* value = bgr(v, u).val;
      dark_(v, u) = is_dark(value, dark_below_(v, u).val, 0) ? 255 : 0;
      bright_(v, u) = is_bright(bgr(v, u), background_(v, u), gain) ? 255 : 0;
      spots_(v, u) = is_full(value, 0) && !is_full(background_(v, u).val, 0) ? 255 : 0;
    }
  const auto is_other_light = [&](int pixels) {
    return pixels * kOtherLightIn >= static_cast<int>(bgr.total());
  };
  const int ink = dots_.empty() ? 0 : cv::countNonZero(dots_);
  if (!is_other_light(cv::countNonZero(dark_) - ink)) spots_ |= dark_;
  if (!is_other_light(cv::countNonZero(bright_))) spots_ |= bright_;
  if (cv::countNonZero(spots_) == 0 && dots_.empty()) return false;
  spread_spots(spots_, spots_);
  if (!dots_.empty()) spots_ |= dots_;
  readable_ = (spots_ == 0) & 1;
  return true;
}

/// Interpolates the difference between picture and background over the spots, from readable pixels up to 12
/// pixels away. In the middle of a larger spot the difference is zero, as on bare gel.
const cv::Mat3b& PixelRepair::fill_spots(const cv::Mat3b& bgr, int smooth_rounds) {
  cv::subtract(bgr, background_, difference_, cv::noArray(), CV_32F);
  difference_.setTo(cv::Scalar::all(0), readable_ == 0);
  readable_.convertTo(weight_, CV_32F);
  // Two box filters in a row have nearly the shape of a cone, so the nearest pixels weigh most.
  for (int pass = 0; pass < 2; ++pass) {
    constexpr int side = 3 * kBlockPx + 1;
    cv::boxFilter(difference_, difference_, CV_32F, {side, side});
    cv::boxFilter(weight_, weight_, CV_32F, {side, side});
  }
  for (int v = 0; v < bgr.rows; ++v)
    for (int u = 0; u < bgr.cols; ++u) {
      constexpr float kRounding = 1e-3F;
      const float weight = weight_(v, u);
      cv::Vec3f& difference = difference_(v, u);
      if (readable_(v, u) != 0)
        difference = cv::Vec3f(bgr(v, u)) - cv::Vec3f(background_(v, u));
      else
        difference = weight > kRounding ? difference / weight : cv::Vec3f();
    }
  smooth_filled(smooth_rounds);
  bgr.copyTo(filled_);
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      if (readable_(v, u) != 0) continue;
      const cv::Vec3f& around = difference_(v, u);
      for (int c = 0; c < 3; ++c)
        filled_(v, u)[c] = cv::saturate_cast<unsigned char>(background_(v, u)[c] + around[c]);
    }
  }
  return filled_;
}

/// Moves the interpolated differences toward the solution of the Laplace equation with the pixels around each
/// spot as boundary values, by steps of successive over-relaxation. This continues the shading of a contact
/// smoothly across a printed dot.
void PixelRepair::smooth_filled(int rounds) {
  constexpr float kOverRelaxation = 1.7F;
  const int rows = difference_.rows, cols = difference_.cols;
  std::vector<cv::Point> places;
  if (rounds > 0) cv::findNonZero(readable_ == 0, places);
  for (int round = 0; round < rounds; ++round)
    for (const cv::Point& place : places) {
      const int u = place.x, v = place.y;
      const cv::Vec3f mean =
          0.25F * (difference_(v, std::max(u - 1, 0)) + difference_(v, std::min(u + 1, cols - 1)) +
                   difference_(std::max(v - 1, 0), u) + difference_(std::min(v + 1, rows - 1), u));
      difference_(v, u) += kOverRelaxation * (mean - difference_(v, u));
    }
}

}  // namespace gelslam::surface::detail
