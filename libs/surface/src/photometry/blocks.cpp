#include "photometry/blocks.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"

namespace gelslam::surface::detail {
namespace {

// The smallest threshold of the averaged color difference, in gray levels.
constexpr float kMinChangeLevels = 0.8F;
// The threshold divided by the lower quartile of the averaged difference. That quartile measures the noise,
// because it belongs to bare gel even when most of the gel is touched: for Gaussian noise in three channels
// it is 1.1 sigma. With 4.5 quartiles (5 sigma), noise alone makes one block in 10^4 appear changed.
constexpr float kQuartilesAboveNoise = 4.5F;
// The largest quartile that is taken for noise, six times that of a camera. A larger one is caused by a
// texture that covers the whole gel.
constexpr float kMaxNoiseLevels = 2.2F;
constexpr int kMarginBlocks = 2;  // by which the result is dilated

GELSLAM_CLONES void add_row(const unsigned char* pixels, int channels, unsigned short* sums) {
  for (int i = 0; i < channels; ++i) sums[i] = static_cast<unsigned short>(sums[i] + pixels[i]);
}

}  // namespace

cv::Size block_grid(cv::Size image) {
  return {(image.width + kBlockPx - 1) / kBlockPx, (image.height + kBlockPx - 1) / kBlockPx};
}

cv::Mat1b all_blocks(cv::Size image) { return {block_grid(image), static_cast<unsigned char>(255)}; }

void BlockAverager::average(const cv::Mat3b& bgr, cv::Mat3f& means) {
  means.create(block_grid(bgr.size()));
  const int channels = 3 * bgr.cols;
  column_sums_.resize(static_cast<std::size_t>(channels));
  unsigned short* sums = column_sums_.data();
  for (int row = 0; row < means.rows; ++row) {
    const int first = row * kBlockPx;
    const int height = std::min(kBlockPx, bgr.rows - first);
    std::fill(column_sums_.begin(), column_sums_.end(), static_cast<unsigned short>(0));
    for (int v = first; v < first + height; ++v) add_row(bgr[v]->val, channels, sums);
    for (int column = 0; column < means.cols; ++column) {
      const int left = column * kBlockPx;
      const int width = std::min(kBlockPx, bgr.cols - left);
      int total[3] = {0, 0, 0};
      for (int u = left; u < left + width; ++u)
        for (int c = 0; c < 3; ++c) total[c] += sums[3 * u + c];
      const float scale = 1.0F / static_cast<float>(width * height);
      for (int c = 0; c < 3; ++c) means(row, column)[c] = static_cast<float>(total[c]) * scale;
    }
  }
}

cv::Mat3f average_blocks(const cv::Mat3b& bgr) {
  cv::Mat3f means;
  BlockAverager().average(bgr, means);
  return means;
}

void spread_blocks(const cv::Mat1b& blocks, cv::Mat1b& pixels) {
  for (int v = 0; v < pixels.rows; ++v) {
    unsigned char* out = pixels[v];
    if (v % kBlockPx != 0) {
      std::copy(pixels[v - 1], pixels[v - 1] + pixels.cols, out);
      continue;
    }
    const unsigned char* in = blocks[v / kBlockPx];
    for (int u = 0; u < pixels.cols; ++u) out[u] = in[u / kBlockPx];
  }
}

void gather_blocks(const cv::Mat1b& pixels, cv::Mat1b& blocks) {
  blocks.create(block_grid(pixels.size()));
  std::vector<unsigned char> columns(static_cast<std::size_t>(pixels.cols));
  for (int row = 0; row < blocks.rows; ++row) {
    std::fill(columns.begin(), columns.end(), static_cast<unsigned char>(0));
    for (int v = row * kBlockPx; v < std::min((row + 1) * kBlockPx, pixels.rows); ++v) {
      const unsigned char* in = pixels[v];
      for (std::size_t u = 0; u < columns.size(); ++u) columns[u] |= in[u];
    }
    for (int column = 0; column < blocks.cols; ++column) {
      const auto left = columns.begin() + column * kBlockPx;
      const auto right = columns.begin() + std::min((column + 1) * kBlockPx, pixels.cols);
      blocks(row, column) = std::any_of(left, right, [](unsigned char set) { return set != 0; }) ? 255 : 0;
    }
  }
}

void ChangeDetector::detect(const cv::Mat3f& difference, cv::Mat1b& changed_blocks) {
  cv::blur(difference, mean_, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  squared_.create(mean_.size());
  const cv::Vec3f* const mean = mean_.ptr<cv::Vec3f>();
  std::transform(mean, mean + mean_.total(), squared_.ptr<float>(),
                 [](const cv::Vec3f& color) { return color.dot(color); });
  const float threshold = threshold_levels();
  cv::compare(squared_, threshold * threshold, core_, cv::CMP_GT);
  constexpr int side = 2 * kMarginBlocks + 1;
  cv::dilate(core_, changed_blocks, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side, side)));
}

float ChangeDetector::threshold_levels() {
  // With little noise the threshold is kMinChangeLevels. To count the blocks below the quartile that belongs
  // to it is ten times faster than to select the quartile.
  constexpr float kQuiet = kMinChangeLevels / kQuartilesAboveNoise;
  const float* const squared = squared_.ptr<float>();
  const float* const end = squared + squared_.total();
  const auto quiet = std::count_if(squared, end, [](float value) { return value < kQuiet * kQuiet; });
  if (4 * quiet > end - squared + 3) return kMinChangeLevels;
  scratch_.assign(squared, end);
  const float quartile = std::sqrt(quantile_in_place(scratch_, 0.25));
  return std::max(kMinChangeLevels, kQuartilesAboveNoise * std::min(quartile, kMaxNoiseLevels));
}

}  // namespace gelslam::surface::detail
