#include "photometry/block_image.hpp"

#include <algorithm>

namespace gelslam::surface::detail {

cv::Size block_grid(cv::Size image) {
  return {(image.width + block_px - 1) / block_px, (image.height + block_px - 1) / block_px};
}

void BlockAverager::average(const cv::Mat3b& bgr, cv::Mat3f& means) {
  means.create(block_grid(bgr.size()));
  const int channels = 3 * bgr.cols;
  column_sums_.resize(static_cast<std::size_t>(channels));
  unsigned short* sums = column_sums_.data();
  for (int row = 0; row < means.rows; ++row) {
    const int first = row * block_px;
    const int height = std::min(block_px, bgr.rows - first);
    std::fill(column_sums_.begin(), column_sums_.end(), static_cast<unsigned short>(0));
    for (int v = first; v < first + height; ++v) {
      const unsigned char* pixels = bgr[v]->val;
      for (int i = 0; i < channels; ++i) sums[i] = static_cast<unsigned short>(sums[i] + pixels[i]);
    }
    for (int column = 0; column < means.cols; ++column) {
      const int left = column * block_px;
      const int width = std::min(block_px, bgr.cols - left);
      int total[3] = {0, 0, 0};
      for (int u = left; u < left + width; ++u) {
        for (int c = 0; c < 3; ++c) total[c] += sums[3 * u + c];
      }
      const float scale = 1.0F / static_cast<float>(width * height);
      for (int c = 0; c < 3; ++c) means(row, column)[c] = static_cast<float>(total[c]) * scale;
    }
  }
}

void spread_blocks(const cv::Mat1b& blocks, cv::Mat1b& pixels) {
  for (int v = 0; v < pixels.rows; ++v) {
    unsigned char* out = pixels[v];
    if (v % block_px != 0) {
      std::copy(pixels[v - 1], pixels[v - 1] + pixels.cols, out);
      continue;
    }
    const unsigned char* in = blocks[v / block_px];
    for (int u = 0; u < pixels.cols; ++u) out[u] = in[u / block_px];
  }
}

void gather_blocks(const cv::Mat1b& pixels, cv::Mat1b& blocks) {
  blocks.create(block_grid(pixels.size()));
  blocks.setTo(0);
  for (int v = 0; v < pixels.rows; ++v) {
    const unsigned char* in = pixels[v];
    unsigned char* out = blocks[v / block_px];
    for (int u = 0; u < pixels.cols; ++u) out[u / block_px] |= in[u];
  }
}

}  // namespace gelslam::surface::detail
