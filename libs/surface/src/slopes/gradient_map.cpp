// Reads the gradient of the height from colors, with the network of NormalFlow (Huang et al., RA-L 2024). At
// the pixel (u, v) with the color c, converted to the background's light,
//     g = A (tan a(s c / 255, u/W, v/H) - tan a(s b / 255, u/W, v/H)),
// where a are the two slope angles that the network reads, A is GradientModel::slope_matrix, and b the color
// of the background at that pixel. For each channel, s is the mean color of the bare gel in training divided
// by that of the background, or 1 if the model does not state it. A and s are not in the papers.

#include "slopes/gradient_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "gelslam/core/error.hpp"
#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/slopes.hpp"
#include "lanes.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {

namespace {

constexpr float kMaxAngleRad = 1.5F;  // keeps the tangent finite; no gel is steeper
// The network is extrapolated within a block if no channel varies by more than this many gray levels there.
constexpr int kSmoothLevels = 10;
// The change of the slopes by one gray level for which slope_noise_ratio is 1. The models of five
// sensors have 0.006 to 0.010 on their own sensor. With 0.0078, the value of the rendered sequences, 14 pairs
// of real logs lost 53 instead of 35 frames, and rendered logs hardly changed.
constexpr double kUsualSlopePerLevel = 0.0065;
constexpr int kBlockArea = kBlockPx * kBlockPx;

/// Extrapolates the slope angles from the center of block `i` of a tile to its 16 pixels, with the
/// derivatives of the network. `color`: the colors of the pixels, channel by channel; `column`, `row`: the
/// network's inputs for the positions, from the first pixel of the block on; `angle`: receives 16 values of
/// the first output, and kNetworkTile numbers later those of the second.
GELSLAM_CLONES void extend_block(const NetworkTile& tile, const NetworkJacobian& jacobian, std::size_t i,
                                 const float* color, const float* column, const float* row, float* angle) {
  constexpr std::size_t kInputs = GradientModel::kShape.sizes.front();
  static_assert(kInputs == 5 && kLanes == 2 * kBlockPx);
  for (std::size_t first = 0; first < kBlockArea; first += kLanes, row += 2) {
    Lanes step[kInputs];
    for (std::size_t c = 0; c < 3; ++c) std::memcpy(&step[c], color + c * kBlockArea + first, sizeof step[c]);
    step[3] = Lanes{column[0], column[1], column[2], column[3], column[0], column[1], column[2], column[3]};
    step[4] = Lanes{row[0], row[0], row[0], row[0], row[1], row[1], row[1], row[1]};
    for (std::size_t k = 0; k < kInputs; ++k) step[k] -= tile.input[k * kNetworkTile + i];
    for (std::size_t o = 0; o < 2; ++o) {
      Lanes sum = Lanes{} + tile.output[o * kNetworkTile + i];
      for (std::size_t k = 0; k < kInputs; ++k) sum += jacobian.of_output[o][k * kNetworkTile + i] * step[k];
      std::memcpy(angle + o * kNetworkTile + first, &sum, sizeof sum);
    }
  }
}

}  // namespace

// Computes tangents by the power series of sine and cosine, without branches or calls.
GELSLAM_CLONES void tangents(NetworkTile::Values<2>& angles_rad) {
  for (std::size_t first = 0; first < angles_rad.size(); first += kLanes) {
    Lanes x;
    std::memcpy(&x, angles_rad.data() + first, sizeof x);
    const Lanes limit = Lanes{} + kMaxAngleRad;
    x = x < -limit ? -limit : x;
    x = x > limit ? limit : x;
    const Lanes s = x * x;
    const Lanes sine =
        x * (1.0F + s * (-1.0F / 6 + s * (1.0F / 120 +
                                          s * (-1.0F / 5040 + s * (1.0F / 362880 - s * (1.0F / 39916800))))));
    const Lanes cosine =
        1.0F +
        s * (-0.5F + s * (1.0F / 24 + s * (-1.0F / 720 + s * (1.0F / 40320 + s * (-1.0F / 3628800 +
                                                                                  s * (1.0F / 479001600))))));
    x = sine / cosine;
    std::memcpy(angles_rad.data() + first, &x, sizeof x);
  }
}

GradientMap::GradientMap(const GradientModel& model, const cv::Mat3b& background)
    : network_(model),
      slope_matrix_(model.slope_matrix),
      background_gx_(background.size(), 0.0F),
      background_gy_(background.size(), 0.0F) {
  if (model.bare_gel_bgr) {
    const std::array<float, 3> seen = mean_color(background);
    for (std::size_t c = 0; c < 3; ++c) to_unit_[c] *= (*model.bare_gel_bgr)[c] / std::max(seen[c], 1.0F);
  }
  for (int u = 0; u < background.cols; ++u)
    column_.push_back(static_cast<float>(u) / static_cast<float>(background.cols));
  for (int v = 0; v < background.rows; ++v)
    row_.push_back(static_cast<float>(v) / static_cast<float>(background.rows));
  cv::Mat1f gx, gy;
  compute(background, color_table(Light{}), all_blocks(background.size()), gx, gy);
  background_gx_ = gx;
  background_gy_ = gy;
  slope_noise_ratio_ = slope_per_level(background) / kUsualSlopePerLevel;
}

/// Returns the root mean square change of a slope when one channel changes by one gray level, over the three
/// channels, both slopes and every eighth pixel of the background.
double GradientMap::slope_per_level(const cv::Mat3b& background) {
  constexpr int kStepPx = 2 * kBlockPx;
  const ColorTable unchanged = color_table(Light{});
  const auto [xx, xy, yx, yy] = slope_matrix_;
  double squares = 0, count = 0;
  for (int v = kBlockPx; v < background.rows; v += kStepPx)
    for (int left = kBlockPx; left < background.cols; left += kNetworkTile * kStepPx) {
      const int filled = std::min(kNetworkTile, (background.cols - left + kStepPx - 1) / kStepPx);
      for (int i = 0; i < filled; ++i)
        fill_features(static_cast<std::size_t>(i), background, {left + i * kStepPx, v}, unchanged);
      network_.forward(tile_);
      network_.jacobian(tile_, jacobian_);
      for (std::size_t i = 0; i < static_cast<std::size_t>(filled); ++i)
        for (std::size_t at = i; at < 3 * kNetworkTile; at += kNetworkTile, count += 2) {
          const float unit = to_unit_[at / kNetworkTile], x = unit * jacobian_.of_output[0][at],
                      y = unit * jacobian_.of_output[1][at];
          squares += std::pow(xx * x + xy * y, 2) + std::pow(yx * x + yy * y, 2);
        }
    }
  return std::sqrt(squares / count);
}

/// Replaces the angles in angles_ by the slopes: their tangents, corrected by the model's slope_matrix.
void GradientMap::to_slopes() {
  tangents(angles_);
  if (slope_matrix_ == GradientModel{}.slope_matrix) return;
  const auto [xx, xy, yx, yy] = slope_matrix_;
  for (std::size_t i = 0; i < kNetworkTile; ++i) {
    const float x = angles_[i], y = angles_[kNetworkTile + i];
    angles_[i] = xx * x + xy * y;
    angles_[kNetworkTile + i] = yx * x + yy * y;
  }
}

void GradientMap::compute(const cv::Mat3b& bgr, const ColorTable& colors, const cv::Mat1b& blocks,
                          cv::Mat1f& gx, cv::Mat1f& gy) {
  gx.create(bgr.size());
  gy.create(bgr.size());
  std::fill_n(gx.ptr<float>(), gx.total(), 0.0F);
  std::fill_n(gy.ptr<float>(), gy.total(), 0.0F);
  gx_ = gx;
  gy_ = gy;
  sort_blocks(bgr, blocks);
  run_smooth(bgr, colors);
  run_rough(bgr, colors);
}

/// Divides the blocks into smooth ones, in which no channel varies by more than kSmoothLevels, and the
/// others.
void GradientMap::sort_blocks(const cv::Mat3b& bgr, const cv::Mat1b& blocks) {
  smooth_.clear();
  rough_.clear();
  const auto channels = static_cast<std::size_t>(3 * bgr.cols);
  least_.resize(channels);
  most_.resize(channels);
  for (int top = 0; top < bgr.rows; top += kBlockPx) {
    const int height = std::min(kBlockPx, bgr.rows - top);
    std::copy_n(bgr[top]->val, channels, least_.begin());
    std::copy_n(bgr[top]->val, channels, most_.begin());
    for (int v = top + 1; v < top + height; ++v) {
      const unsigned char* value = bgr[v]->val;
      unsigned char *least = least_.data(), *most = most_.data();
      for (std::size_t i = 0; i < channels; ++i) {
        least[i] = std::min(least[i], value[i]);
        most[i] = std::max(most[i], value[i]);
      }
    }
    for (int left = 0; left < bgr.cols; left += kBlockPx) {
      if (blocks(top / kBlockPx, left / kBlockPx) == 0) continue;
      const int width = std::min(kBlockPx, bgr.cols - left);
      if (width == kBlockPx && height == kBlockPx && color_range(left) <= kSmoothLevels) {
        smooth_.emplace_back(left, top);
        continue;
      }
      for (int v = top; v < top + height; ++v)
        for (int u = left; u < left + width; ++u) rough_.emplace_back(u, v);
    }
  }
}

/// Returns the largest range of a channel, in gray levels, within the block whose first column is `left`, in
/// the row of blocks that least_ and most_ describe.
int GradientMap::color_range(int left) const {
  int range = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    unsigned char least = 255, most = 0;
    for (std::size_t u = 0; u < kBlockPx; ++u) {
      const std::size_t i = 3 * (static_cast<std::size_t>(left) + u) + c;
      least = std::min(least, least_[i]);
      most = std::max(most, most_[i]);
    }
    range = std::max(range, most - least);
  }
  return range;
}

/// Evaluates the network once for each smooth block, at its mean color and its center, and extrapolates to
/// the pixels.
void GradientMap::run_smooth(const cv::Mat3b& bgr, const ColorTable& colors) {
  constexpr std::size_t kBlocksAtOnce = kNetworkTile / kBlockArea;  // the blocks whose pixels fill a tile
  colors_of_blocks_.resize(3 * kBlockArea * kNetworkTile);
  std::array<std::array<float, 256>, 3> unit;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t value = 0; value < 256; ++value) unit[c][value] = colors[c][value] * to_unit_[c];
  for (std::size_t first = 0; first < smooth_.size(); first += kNetworkTile) {
    const std::size_t blocks = std::min<std::size_t>(kNetworkTile, smooth_.size() - first);
    for (std::size_t i = 0; i < blocks; ++i) {
      const auto [left, top] = smooth_[first + i];
      std::array<float, 3> sum{};
      float* color = colors_of_blocks_.data() + 3 * kBlockArea * i;
      for (int v = top; v < top + kBlockPx; ++v) {
        const unsigned char* value = bgr[v][left].val;
        for (int u = 0; u < kBlockPx; ++u, value += 3, ++color)
          for (std::size_t c = 0; c < 3; ++c) {
            color[c * kBlockArea] = unit[c][value[c]];
            sum[c] += color[c * kBlockArea];
          }
      }
      float* feature = tile_.input.data() + i;
      for (std::size_t c = 0; c < 3; ++c) feature[c * kNetworkTile] = sum[c] / kBlockArea;
      const auto u = static_cast<std::size_t>(left), v = static_cast<std::size_t>(top);
      feature[3 * kNetworkTile] = 0.5F * (column_[u] + column_[u + kBlockPx - 1]);
      feature[4 * kNetworkTile] = 0.5F * (row_[v] + row_[v + kBlockPx - 1]);
    }
    network_.forward(tile_);
    network_.jacobian(tile_, jacobian_);
    for (std::size_t i = 0; i < blocks; ++i) {
      const auto [left, top] = smooth_[first + i];
      const std::size_t at = i % kBlocksAtOnce * kBlockArea;
      extend_block(tile_, jacobian_, i, colors_of_blocks_.data() + 3 * kBlockArea * i, column_.data() + left,
                   row_.data() + top, angles_.data() + at);
      if (i % kBlocksAtOnce + 1 == kBlocksAtOnce || i + 1 == blocks)
        write_blocks(smooth_.data() + first + i - i % kBlocksAtOnce, i % kBlocksAtOnce + 1);
    }
  }
}

/// Converts angles_ to slopes, subtracts those of the background, and writes them to whole blocks with the
/// given first pixels.
void GradientMap::write_blocks(const cv::Point* corners, std::size_t blocks) {
  to_slopes();
  const float* slope_x = angles_.data();
  const float* slope_y = slope_x + kNetworkTile;
  for (std::size_t i = 0; i < blocks; ++i)
    for (int v = corners[i].y; v < corners[i].y + kBlockPx; ++v) {
      const int left = corners[i].x;
      float *out_x = gx_[v] + left, *out_y = gy_[v] + left;
      const float *background_x = background_gx_[v] + left, *background_y = background_gy_[v] + left;
      for (int u = 0; u < kBlockPx; ++u) {
        out_x[u] = *slope_x++ - background_x[u];
        out_y[u] = *slope_y++ - background_y[u];
      }
    }
}

void GradientMap::fill_features(std::size_t i, const cv::Mat3b& bgr, const cv::Point& pixel,
                                const ColorTable& colors) {
  const cv::Vec3b& color = bgr(pixel);
  float* feature = tile_.input.data() + i;
  for (std::size_t c = 0; c < 3; ++c)
    feature[c * kNetworkTile] = colors[c][color[static_cast<int>(c)]] * to_unit_[c];
  feature[3 * kNetworkTile] = column_[static_cast<std::size_t>(pixel.x)];
  feature[4 * kNetworkTile] = row_[static_cast<std::size_t>(pixel.y)];
}

void GradientMap::run_rough(const cv::Mat3b& bgr, const ColorTable& colors) {
  for (std::size_t first = 0; first < rough_.size(); first += kNetworkTile) {
    const std::size_t count = std::min<std::size_t>(kNetworkTile, rough_.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      fill_features(i, bgr, rough_[first + i], colors);
      pixels_[i] = rough_[first + i].y * bgr.cols + rough_[first + i].x;
    }
    network_.forward(tile_);
    angles_ = tile_.output;
    write_slopes(static_cast<int>(count));
  }
}

void GradientMap::write_slopes(int count) {
  to_slopes();
  const float* const slope_x = angles_.data();
  const float* const slope_y = slope_x + kNetworkTile;
  float* out_x = gx_.ptr<float>();
  float* out_y = gy_.ptr<float>();
  const float* background_x = background_gx_.ptr<float>();
  const float* background_y = background_gy_.ptr<float>();
  for (int i = 0; i < count; ++i) {
    const int pixel = pixels_[static_cast<std::size_t>(i)];
    out_x[pixel] = slope_x[i] - background_x[pixel];
    out_y[pixel] = slope_y[i] - background_y[pixel];
  }
}

}  // namespace gelslam::surface::detail

namespace gelslam {

SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background) {
  if (bgr.size() != background.size()) throw Error("image and background differ in size");
  SlopeMap map;
  using namespace surface::detail;
  GradientMap(model, background).compute(bgr, color_table(Light{}), all_blocks(bgr.size()), map.gx, map.gy);
  return map;
}

}  // namespace gelslam
