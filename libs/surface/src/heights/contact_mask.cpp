#include "heights/contact_mask.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/target_clones.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// A touch is this share of the deepest place deep; of one deeper than 0.8 mm the membrane rim alone is deeper
// than 0.2 mm.
constexpr double kDepthShare = 0.3, kDeepShare = 0.25;
constexpr double kMinLimitMm = 0.015;  // what the network's own noise integrates to
constexpr float kScattersAboveGel = 4.0F;
constexpr double kMinColorLevels = 4.0;   // noise of a block mean stays below
constexpr int kStretchPx = 32;            // speed: looked at together
constexpr int kFewPixels = 50;            // a depth that fewer pixels reach is noise
constexpr double kBlurSigmaBlocks = 1.2;  // numerics: kernel
constexpr int kBlurRadiusBlocks = 2;      // numerics
constexpr double kPressedShare = 0.5;     // of the depth; a membrane rim has 0, a flat face 1

/// Value `beyond` blocks outside the first of `count` values: continues the parabola through three of them.
/// (A constant continuation would bend the gel at the border, and the contact's outline with it.)
template <typename At>
float extrapolate(const At& at, int beyond, int count) {
  const int near = std::min(beyond, count - 1), far = std::min(2 * beyond, count - 1);
  return 3.0F * at(0) - 3.0F * at(near) + at(far);
}

/// `inner` with a margin on all sides, into which its values are extrapolated.
void add_margin(const cv::Mat1f& inner, int margin, cv::Mat1f& padded) {
  cv::copyMakeBorder(inner, padded, margin, margin, margin, margin, cv::BORDER_REPLICATE);
  const int last_row = inner.rows - 1, last_column = inner.cols - 1;
  for (int v = margin; v <= margin + last_row; ++v) {
    float* row = padded[v];
    for (int i = 1; i <= margin; ++i) {
      row[margin - i] = extrapolate([&](int k) { return row[margin + k]; }, i, inner.cols);
      row[margin + last_column + i] =
          extrapolate([&](int k) { return row[margin + last_column - k]; }, i, inner.cols);
    }
  }
  for (int i = 1; i <= margin; ++i) {
    for (int u = 0; u < padded.cols; ++u) {
      padded(margin - i, u) = extrapolate([&](int k) { return padded(margin + k, u); }, i, inner.rows);
      padded(margin + last_row + i, u) =
          extrapolate([&](int k) { return padded(margin + last_row - k, u); }, i, inner.rows);
    }
  }
}

GELSLAM_CLONES bool any_below(const float* value, int count, float bound) {
  int found = 0;
  for (int i = 0; i < count; ++i) found |= value[i] < bound ? 1 : 0;
  return found != 0;
}

cv::Mat square(int side_px) { return cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side_px, side_px)); }

}  // namespace

cv::Rect grown(const cv::Rect& box, int margin, cv::Size image) {
  if (box.empty()) return box;
  return (box + cv::Size(2 * margin, 2 * margin) - cv::Point(margin, margin)) & cv::Rect({}, image);
}

void PressureMap::keep_pressed(const cv::Mat1f& height_mm, double pixel_pitch_mm, cv::Mat1b& mask) {
  const cv::Rect box = cv::boundingRect(mask);
  if (box.empty()) return;
  const cv::Size whole = height_mm.size() / kBlockPx, grid = block_grid(height_mm.size());
  cv::resize(height_mm(cv::Rect({}, whole * kBlockPx)), depth_, whole, 0, 0, cv::INTER_AREA);
  depth_ *= -1.0;
  constexpr int margin =
      kBlurRadiusBlocks + 2;  // one more for the Laplacian, one for blocks cut by the border
  add_margin(depth_, margin, padded_);
  constexpr int side = 2 * kBlurRadiusBlocks + 1;
  cv::GaussianBlur(padded_, padded_, cv::Size(side, side), kBlurSigmaBlocks);
  cv::Laplacian(padded_, laplacian_, CV_32F, 1);
  const double rim_length_blocks = kRimLengthMm / (pixel_pitch_mm * kBlockPx);
  const cv::Rect inside(cv::Point(margin, margin), grid);
  cv::addWeighted(padded_(inside), 1.0 - kPressedShare, laplacian_(inside),
                  -rim_length_blocks * rim_length_blocks, 0.0, excess_);
  // Blocks of the box, and one more around, because values are interpolated between the blocks' middles.
  const cv::Point first = box.tl() / kBlockPx, last = (box.br() - cv::Point(1, 1)) / kBlockPx;
  const cv::Rect around = grown(cv::Rect(first, last + cv::Point(1, 1)), 1, grid);
  cv::resize(excess_(around), excess_px_, around.size() * kBlockPx, 0, 0, cv::INTER_LINEAR);
  cv::compare(excess_px_(box - around.tl() * kBlockPx), 0.0, pressed_, cv::CMP_GT);
  cv::bitwise_and(mask(box), pressed_, mask(box));
}

ContactDetector::ContactDetector(cv::Size size, const ContactRule& rule)
    : rule_(rule), half_gap_px_(size.height / 48), gap_(square(2 * half_gap_px_ + 1)) {}

double ContactDetector::depth_limit_mm(const cv::Mat1f& height_mm, float scatter_mm) {
  const double floor_mm =
      std::max(rule_.slope_noise * kMinLimitMm, static_cast<double>(kScattersAboveGel * scatter_mm));
  // Holds the deepest pixels seen so far; `bound` is the least deep of them once they are enough.
  constexpr std::size_t room = 1024, kept = kFewPixels + 1;
  scratch_.clear();
  float bound = static_cast<float>(-floor_mm);
  const auto keep_deepest = [&] {
    if (scratch_.size() <= kept) return;
    std::nth_element(scratch_.begin(), scratch_.begin() + kFewPixels, scratch_.end());
    scratch_.resize(kept);
    bound = scratch_.back();
  };
  for (int v = 0; v < height_mm.rows; ++v)
    for (int left = 0; left < height_mm.cols; left += kStretchPx) {
      const float* const height = height_mm[v] + left;
      const int count = std::min(kStretchPx, height_mm.cols - left);
      if (!any_below(height, count, bound)) continue;
      std::copy_if(height, height + count, std::back_inserter(scratch_), [&](float h) { return h < bound; });
      if (scratch_.size() > room) keep_deepest();
    }
  if (scratch_.empty()) return floor_mm;
  keep_deepest();
  const double depth_mm = -static_cast<double>(*std::max_element(scratch_.begin(), scratch_.end()));
  const double cap_mm = std::max(rule_.height_threshold_mm, kDeepShare * depth_mm);
  return std::min(cap_mm, std::max(floor_mm, kDepthShare * depth_mm));
}

void ContactDetector::keep_colored_pieces(const cv::Mat3f& block_difference, double color_threshold,
                                          cv::Mat1b& contact) {
  gather_blocks(contact, blocks_);
  const int pieces = cv::connectedComponents(blocks_, labels_, 8, CV_32S);
  std::vector<bool> colored(static_cast<std::size_t>(pieces), false);
  for (int row = 0; row < blocks_.rows; ++row) {
    for (int column = 0; column < blocks_.cols; ++column) {
      if (blocks_(row, column) == 0) continue;
      const cv::Vec3f& difference = block_difference(row, column);
      if (static_cast<double>(difference.dot(difference)) > color_threshold * color_threshold)
        colored[static_cast<std::size_t>(labels_(row, column))] = true;
    }
  }
  colored[0] = false;  // label 0 is no piece
  if (std::all_of(colored.begin() + 1, colored.end(), [](bool seen) { return seen; })) return;
  for (int row = 0; row < blocks_.rows; ++row) {
    for (int column = 0; column < blocks_.cols; ++column)
      if (!colored[static_cast<std::size_t>(labels_(row, column))]) blocks_(row, column) = 0;
  }
  keep_.create(contact.size());
  spread_blocks(blocks_, keep_);
  cv::bitwise_and(contact, keep_, contact);
}

void ContactDetector::close_gaps(cv::Mat1b& contact) {
  cv::dilate(contact, closed_, gap_);
  cv::erode(closed_, closed_, gap_, cv::Point(-1, -1), 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::bitwise_or(contact, closed_, contact);
}

void ContactDetector::fill_small_holes(const cv::Mat1b& below, cv::Mat1b& contact) {
  cv::bitwise_not(contact, holes_);
  const int count = cv::connectedComponents(holes_, labels_, 4, CV_32S);
  constexpr int kOpen = std::numeric_limits<int>::max();
  area_px_.assign(static_cast<std::size_t>(count), 0);
  const auto area_px = [&](int v, int u) -> int& {
    return area_px_[static_cast<std::size_t>(labels_(v, u))];
  };
  area_px_[0] = kOpen;  // the contact
  for (int v = 0; v < contact.rows; ++v) area_px(v, 0) = area_px(v, contact.cols - 1) = kOpen;
  for (int u = 0; u < contact.cols; ++u) area_px(0, u) = area_px(contact.rows - 1, u) = kOpen;
  if (std::all_of(area_px_.begin(), area_px_.end(), [](int area) { return area == kOpen; })) return;
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (int& area = area_px(v, u); area != kOpen) ++area;
  const int largest_px = 8 * half_gap_px_ * 8 * half_gap_px_;
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (area_px(v, u) < largest_px && below(v, u)) contact(v, u) = 255;
}

void ContactDetector::detect(const cv::Mat1f& height_mm, double pixel_pitch_mm, float scatter_mm,
                             const cv::Mat3f& block_difference, cv::Mat1b& contact) {
  const double limit_mm = depth_limit_mm(height_mm, scatter_mm);
  const double deep =
      std::min(1.0, limit_mm / rule_.height_threshold_mm);  // 1: as deep as the public rule wants
  cv::compare(height_mm, -limit_mm, below_, cv::CMP_LT);
  below_.copyTo(contact);
  pressure_.keep_pressed(height_mm, pixel_pitch_mm, contact);
  // Slivers and the border's blur grow with depth; a faint touch is small and thin itself.
  const auto scaled = [deep](int half_px) {
    return square(2 * std::max(1, static_cast<int>(std::lround(half_px * deep))) + 1);
  };
  if (const cv::Rect box = grown(cv::boundingRect(contact), half_gap_px_ + 1, contact.size()); !box.empty()) {
    cv::Mat1b inside = contact(box);
    close_gaps(inside);
    fill_small_holes(below_(box), inside);
    cv::morphologyEx(inside, inside, cv::MORPH_OPEN, scaled(half_gap_px_));
    cv::erode(inside, inside, scaled(half_gap_px_ / 2));
  }
  keep_colored_pieces(block_difference, std::max(kMinColorLevels, rule_.color_dist_threshold * deep),
                      contact);
}

}  // namespace gelslam::surface::detail
