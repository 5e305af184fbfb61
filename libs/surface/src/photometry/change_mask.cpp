#include "photometry/change_mask.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

constexpr float min_threshold_gray_levels = 0.8F;
// The lower quartile of the averaged difference lies in the untouched gel even when most of the gel is
// touched. For a Gaussian of three channels it is 1.1 sigma; 4.5 of it (5 sigma) leaves one block in 10^4 of
// pure noise.
constexpr float quartiles_above_noise = 4.5F;
// Where a texture covers the whole gel, no quartile lies in untouched gel: what the texture has to exceed is
// then at most this, six times a camera's noise. What light adds is smooth; and where a contact has bare gel
// around, much of it stands out.
constexpr float largest_noise_gray_levels = 2.2F;
constexpr int smooth_blocks = 9;
constexpr double stand_out_in_texture = 0.05, stand_out_in_bare_gel = 0.15;  // shares of the picture
constexpr int margin_blocks = 2;

void square_lengths(const cv::Mat3f& vectors, cv::Mat1f& squared) {
  squared.create(vectors.size());
  std::transform(vectors.begin(), vectors.end(), squared.begin(),
                 [](const cv::Vec3f& v) { return v.dot(v); });
}

/// Of lengths whose squares are given.
float lower_quartile(const cv::Mat1f& squared, std::vector<float>& scratch) {
  scratch.assign(squared.begin(), squared.end());
  const auto quartile = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 4);
  std::nth_element(scratch.begin(), quartile, scratch.end());
  return std::sqrt(*quartile);
}

}  // namespace

/// The lower quartile, but where it is a texture's.
float ChangeDetector::noise_unless_textured() {
  const float quartile = lower_quartile(squared_, scratch_);
  bool is_textured = false;
  if (quartile > largest_noise_gray_levels) {
    const float above = quartiles_above_noise * quartile;
    const auto stand_out = std::count_if(squared_.begin(), squared_.end(),
                                         [above](float squared) { return squared > above * above; });
    const double share = static_cast<double>(stand_out) / static_cast<double>(squared_.total());
    cv::blur(mean_, fine_, cv::Size(smooth_blocks, smooth_blocks));
    cv::subtract(mean_, fine_, fine_);
    square_lengths(fine_, fine_squared_);
    is_textured = share < (was_textured_ ? stand_out_in_bare_gel : stand_out_in_texture) &&
                  lower_quartile(fine_squared_, scratch_) > largest_noise_gray_levels;
  }
  was_textured_ = is_textured;
  return is_textured ? largest_noise_gray_levels : quartile;
}

void ChangeDetector::detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks) {
  cv::blur(difference, mean_, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  square_lengths(mean_, squared_);
  const float noise = noise_unless_textured();
  const float threshold = std::max(min_threshold_gray_levels, quartiles_above_noise * noise);
  cv::compare(squared_, threshold * threshold, core_, cv::CMP_GT);
  constexpr int side = 2 * margin_blocks + 1;
  cv::dilate(core_, changed_blocks, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side, side)));
}

}  // namespace gelslam::surface::detail
