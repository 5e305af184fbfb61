#include "photometry/pixel_repair.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/surface/background.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// Neighbors on a gel differ by less than 10 gray levels, with strong noise by 20. A dithered picture's differ
// by 60 at times, and there the mean tells more than the median: only values further off prove that a picture
// has wrong ones.
constexpr int kWrongLevels = 35;
constexpr int kWrongValueIn = 500;  // fewer than one in 500 are left to the robust weights

constexpr double kDarkShare = 0.5;  // of the background's brightness
constexpr double kInkShare = 0.65;  // of a gel with markers; real presses leave 0.74
constexpr int kSmoothRounds = 20;   // over a dot of ten pixels' radius
constexpr double kUnlitLevel = 10;  // dark pixels in unlit regions carry no information
constexpr int kFailingLightIn = 8;  // more than one in 8 pixels dark: the light fails, and no spot is there

/// Looks at one row in each row of blocks.
bool has_wrong_values(const cv::Mat3b& bgr) {
  int found = 0;
  constexpr int surely = 3 * kWrongLevels;
  for (int v = 0; v < bgr.rows; v += kBlockPx) {
    const unsigned char* value = bgr.ptr<unsigned char>(v);
    for (int i = 3; i < 3 * bgr.cols - 3; ++i) {
      const int low = std::min(value[i - 3], value[i + 3]), high = std::max(value[i - 3], value[i + 3]);
      found += (value[i] > high + surely) | (value[i] < low - surely);
    }
  }
  return found * kBlockPx * kWrongValueIn > 3 * static_cast<int>(bgr.total());
}

/// 255 where two of the three channels are full, else 0.
void mark_full(const cv::Mat3b& bgr, cv::Mat1b& full) {
  full.create(bgr.size());
  std::transform(bgr.begin(), bgr.end(), full.begin(), [](const cv::Vec3b& color) {
    return (color[0] >= kFullLevel) + (color[1] >= kFullLevel) + (color[2] >= kFullLevel) >= 2 ? 255 : 0;
  });
}

}  // namespace

void spread_spots(const cv::Mat1b& spots, cv::Mat1b& spread) {
  constexpr int side = 2 * kBlockPx + 1;  // a spot is spread over a block
  cv::dilate(spots, spread, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
}

PixelRepair::PixelRepair(const cv::Mat3b& background) {
  background_ = replace_wrong_values(background).clone();
  const auto markers = find_marker_dots(background_);
  if (markers) fill_background(markers->mask);
  mark_full(background_, is_full_in_background_);
  background_.convertTo(dark_limit_, CV_8U, markers ? kInkShare : kDarkShare);
  cv::Mat1b is_lit;
  cv::inRange(dark_limit_, cv::Scalar::all(kUnlitLevel), cv::Scalar::all(255), is_lit);
  dark_from_ = cv::Mat3b(background.size(), cv::Vec3b::all(0));
  dark_from_.setTo(cv::Scalar::all(255), is_lit == 0);  // a range that holds nothing
}

void PixelRepair::fill_background(const cv::Mat1b& dots) {
  dots_ = dots;
  readable_ = (dots == 0) & 1;
  const cv::Mat3b seen = background_;
  background_ = cv::Mat3b(seen.size());
  background_.setTo(cv::mean(seen, readable_));  // where no gel is near
  constexpr int thoroughly = 10 * kSmoothRounds;
  background_ = fill_spots(seen, thoroughly).clone();
}

const cv::Mat3b& PixelRepair::clean(const cv::Mat3b& bgr) {
  covered_.release();
  const cv::Mat3b& whole = replace_wrong_values(bgr);
  if (!find_spots(whole)) return whole;
  if (!dots_.empty()) covered_ = readable_ == 0;
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

/// Fills readable_; false where all of the picture is. Two quick looks tell for nearly every picture.
bool PixelRepair::find_spots(const cv::Mat3b& bgr) {
  cv::inRange(bgr, dark_from_, dark_limit_, dark_);
  const int dark = cv::countNonZero(dark_), full = cv::countNonZero(bgr.reshape(1) >= kFullLevel);
  if (full < 2 && dark == 0 && dots_.empty()) return false;
  mark_full(bgr, spots_);
  spots_.setTo(0, is_full_in_background_);
  const int ink = dots_.empty() ? 0 : cv::countNonZero(dots_);
  if ((dark - ink) * kFailingLightIn < static_cast<int>(bgr.total())) spots_ |= dark_;
  if (cv::countNonZero(spots_) == 0 && dots_.empty()) return false;
  spread_spots(spots_, spots_);
  if (!dots_.empty()) spots_ |= dots_;
  readable_ = (spots_ == 0) & 1;
  return true;
}

/// From up to three blocks away. The middle of a larger spot is taken for bare gel.
const cv::Mat3b& PixelRepair::fill_spots(const cv::Mat3b& bgr, int smooth_rounds) {
  cv::subtract(bgr, background_, difference_, cv::noArray(), CV_32F);
  difference_.setTo(cv::Scalar::all(0), readable_ == 0);
  readable_.convertTo(weight_, CV_32F);
  // Two box filters are nearly a cone: what is near counts most.
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

/// Toward the harmonic function between the edges of each spot, which continues a contact's shading across a
/// marker (successive over-relaxation).
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
