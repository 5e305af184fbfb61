#include "heights/contact_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "photometry/block_image.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double depth_fraction = 0.3;
constexpr double deep_fraction =
    0.25;  // of a contact deeper than 0.8 mm: its membrane rim alone is deeper than 0.2 mm
constexpr double min_limit_mm = 0.015;  // what the network's own noise integrates to
constexpr float scatters_above_gel = 4.0F;
constexpr double min_color_dist = 4.0;       // gray levels: noise of a block mean stays below
constexpr std::ptrdiff_t deepest_rank = 50;  // pixels; a depth that only a few pixels reach is noise

constexpr float max_texture_px = 1.5F;  // 0.1 mm on a GelSight Mini
constexpr int sample_step = 3;          // every third row is plenty for a median

cv::Mat square(int side_px) { return cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side_px, side_px)); }

float order_statistic(std::vector<float>& values, double fraction) {
  const auto rank = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace

UntouchedGel find_untouched_gel(const cv::Mat1f& height_px, const cv::Mat1b& changed,
                                std::vector<float>& scratch) {
  scratch.clear();
  for (int v = 0; v < height_px.rows; v += sample_step) {
    for (int u = 0; u < height_px.cols; ++u) {
      if (changed(v, u) == 0) scratch.push_back(height_px(v, u));
    }
  }
  UntouchedGel gel;
  if (scratch.size() * sample_step * 20 >= height_px.total()) {
    const float lowest = order_statistic(scratch, 0.95) - max_texture_px;
    std::erase_if(scratch, [lowest](float value) { return value < lowest; });
    gel.level = order_statistic(scratch, 0.5);
    for (float& value : scratch) value = std::abs(value - gel.level);
    gel.scatter = 1.4826F * order_statistic(scratch, 0.5);
    gel.seen = true;
    return gel;
  }
  scratch.clear();
  for (int v = 0; v < height_px.rows; ++v)
    scratch.insert(scratch.end(), height_px[v], height_px[v] + height_px.cols);
  gel.level = order_statistic(scratch, 0.85);
  return gel;
}

ContactDetector::ContactDetector(cv::Size size, const ContactRule& rule)
    : rule_(rule),
      pressure_(rule.rim_length_mm),
      half_gap_px_(size.height / 48),
      gap_(square(2 * half_gap_px_ + 1)) {}

double ContactDetector::depth_limit_mm(const cv::Mat1f& height_mm, float scatter_mm) {
  const double floor_mm = std::max(min_limit_mm, static_cast<double>(scatters_above_gel * scatter_mm));
  scratch_.clear();
  for (int v = 0; v < height_mm.rows; ++v) {
    for (const float* height = height_mm[v]; height != height_mm[v] + height_mm.cols; ++height) {
      if (*height < -floor_mm) scratch_.push_back(*height);
    }
  }
  const auto rank = std::min(deepest_rank, static_cast<std::ptrdiff_t>(scratch_.size()) - 1);
  if (rank < 0) return floor_mm;
  std::nth_element(scratch_.begin(), scratch_.begin() + rank, scratch_.end());
  const double depth_mm = -static_cast<double>(scratch_[static_cast<std::size_t>(rank)]);
  const double cap_mm = std::max(rule_.height_threshold_mm, deep_fraction * depth_mm);
  return std::min(cap_mm, std::max(floor_mm, depth_fraction * depth_mm));
}

void ContactDetector::keep_witnessed_pieces(const cv::Mat3f& block_difference, double color_threshold,
                                            cv::Mat1b& contact) {
  gather_blocks(contact, blocks_);
  const int pieces = cv::connectedComponents(blocks_, labels_, 8, CV_32S);
  std::vector<bool> witnessed(static_cast<std::size_t>(pieces), false);
  for (int row = 0; row < blocks_.rows; ++row) {
    for (int column = 0; column < blocks_.cols; ++column) {
      const cv::Vec3f& difference = block_difference(row, column);
      if (static_cast<double>(difference.dot(difference)) > color_threshold * color_threshold) {
        witnessed[static_cast<std::size_t>(labels_(row, column))] = true;
      }
    }
  }
  witnessed[0] = false;  // label 0 is no piece
  if (std::all_of(witnessed.begin() + 1, witnessed.end(), [](bool seen) { return seen; })) return;
  for (int row = 0; row < blocks_.rows; ++row) {
    for (int column = 0; column < blocks_.cols; ++column) {
      if (!witnessed[static_cast<std::size_t>(labels_(row, column))]) blocks_(row, column) = 0;
    }
  }
  keep_.create(contact.size());
  spread_blocks(blocks_, keep_);
  cv::bitwise_and(contact, keep_, contact);
}

void ContactDetector::fill_small_holes(cv::Mat1b& whole_contact) {
  const cv::Rect box = cv::boundingRect(whole_contact);  // an enclosed hole does not reach its border
  if (box.empty()) return;
  cv::Mat1b contact = whole_contact(box);
  const cv::Mat1b below = below_(box);
  cv::bitwise_not(contact, holes_);
  const int count = cv::connectedComponentsWithStats(holes_, labels_, stats_, centroids_, 4, CV_32S);
  const int largest_px = 8 * half_gap_px_ * 8 * half_gap_px_;
  fills_.assign(static_cast<std::size_t>(count), false);
  for (int i = 1; i < count; ++i) {
    const int left = stats_(i, cv::CC_STAT_LEFT), top = stats_(i, cv::CC_STAT_TOP);
    const bool enclosed = left > 0 && top > 0 && left + stats_(i, cv::CC_STAT_WIDTH) < contact.cols &&
                          top + stats_(i, cv::CC_STAT_HEIGHT) < contact.rows;
    fills_[static_cast<std::size_t>(i)] = enclosed && stats_(i, cv::CC_STAT_AREA) < largest_px;
  }
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (fills_[static_cast<std::size_t>(labels_(v, u))] && below(v, u)) contact(v, u) = 255;
}

void ContactDetector::detect(const cv::Mat1f& height_mm, double pixel_pitch_mm, float scatter_mm,
                             const cv::Mat3f& block_difference, cv::Mat1b& contact) {
  const double limit_mm = depth_limit_mm(height_mm, scatter_mm);
  const double deep =
      std::min(1.0, limit_mm / rule_.height_threshold_mm);  // 1: as deep as the public rule wants
  cv::compare(height_mm, -limit_mm, below_, cv::CMP_LT);
  pressure_.find(height_mm, pixel_pitch_mm, pressed_);
  cv::bitwise_and(below_, pressed_, contact);
  cv::morphologyEx(contact, contact, cv::MORPH_CLOSE, gap_);
  fill_small_holes(contact);
  // Slivers and the border's blur grow with depth; a faint touch is small and thin itself.
  const auto scaled = [deep](int half_px) {
    return square(2 * std::max(1, static_cast<int>(std::lround(half_px * deep))) + 1);
  };
  cv::morphologyEx(contact, contact, cv::MORPH_OPEN, scaled(half_gap_px_));
  cv::erode(contact, contact, scaled(half_gap_px_ / 2));
  keep_witnessed_pieces(block_difference, std::max(min_color_dist, rule_.color_dist_threshold * deep),
                        contact);
}

}  // namespace gelslam::surface::detail
