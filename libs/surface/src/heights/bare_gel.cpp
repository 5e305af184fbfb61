#include "heights/bare_gel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/slopes.hpp"
#include "lanes.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr int kCellPx = 2 * kBlockPx;
constexpr int kCellSquares = kCellPx / 2;  // PoissonSolver's
constexpr float kBareSlopeRad = 0.01F;     // what unchanged gel may tilt; color changes show more
constexpr float kBareHeightPx = 0.15F;     // 0.01 mm on a GelSight Mini
constexpr double kMinBareShare = 0.01;     // of the picture; less is no reference
// Slopes that are read too flat on one flank of a contact let bare gel beyond it come out too low by a share
// of the contact's depth. Pressed faces lie lower than that.
constexpr float kMaxFall = 0.3F;
constexpr float kMinFallPx = 3 * kBareHeightPx;

constexpr int kPanel = 4 * kLanes;  // columns at a time, for which vector registers suffice

/// Solves a symmetric band system by Cholesky decomposition; x: the right side, then the solution, and stride
/// zeros. Row i of the band has 2 stride numbers: columns i .. i + stride - 1, then zeros.
GELSLAM_CLONES void solve_band(float* band, float* x, int count, int stride) {
  for (int i = 0; i < count; ++i) {
    float* const row = band + 2 * i * stride;
    for (float* part = row; part != row + stride; part += kPanel) {
      // Two sums: a processor adds to one while the other waits. What was computed last comes last.
      Lanes sum[2][kPanel / kLanes] = {}, other;
      std::memcpy(sum, part, sizeof sum[0]);
      const auto subtract = [&](int j, Lanes* from) {
        const float* const above = part - 2 * j * stride + j;
        const float factor = row[-2 * j * stride + j];
        for (int k = 0; k < kPanel / kLanes; ++k) {
          std::memcpy(&other, above + k * kLanes, sizeof other);
          from[k] -= factor * other;
        }
      };
      int j = std::min(stride - 1, i);
      for (; j > 1; j -= 2) {
        subtract(j, sum[0]);
        subtract(j - 1, sum[1]);
      }
      if (j == 1) subtract(1, sum[0]);
      for (int k = 0; k < kPanel / kLanes; ++k) sum[0][k] += sum[1][k];
      std::memcpy(part, sum, sizeof sum[0]);
    }
    const float scale = 1.0F / std::sqrt(row[0]);
    for (int k = 0; k < stride; ++k) row[k] *= scale;
    const float known = x[i] * scale;
    for (int k = 0; k < stride; ++k) x[i + k] -= row[k] * known;
    x[i] = known;
  }
  for (int i = count - 1; i >= 0; --i) {
    const float* const row = band + 2 * i * stride;
    const float known = x[i];
    x[i] = 0.0F;
    float sum[kLanes] = {};
    for (int part = 0; part < stride; part += kLanes)
      for (int k = 0; k < kLanes; ++k) sum[k] += row[part + k] * x[i + part + k];
    x[i] = (known - std::accumulate(sum, sum + kLanes, 0.0F)) / row[0];
  }
}

}  // namespace

BareGelLeveler::BareGelLeveler(cv::Size size, const cv::Mat1b& confidence)
    : grid_((size.width + kCellPx - 1) / kCellPx, (size.height + kCellPx - 1) / kCellPx),
      changed_variance_(grid_, static_cast<float>(kBestSlopeSigmaRad * kBestSlopeSigmaRad)) {
  if (confidence.empty()) return;
  cv::Mat1f known;
  confidence.convertTo(known, CV_32F, 1.0 / 255);
  cv::resize(known, known, grid_, 0, 0, cv::INTER_AREA);
  cv::divide(changed_variance_, known, changed_variance_);
}

void BareGelLeveler::average_cells(const cv::Mat1f& height_px, const cv::Mat1b& changed) {
  cv::resize(height_px, height_, grid_, 0, 0, cv::INTER_AREA);
  bare_.create(grid_);
  bare_.setTo(255);
  constexpr int kBlocks = kCellPx / kBlockPx;
  for (int row = 0; row < changed.rows; ++row)
    for (int column = 0; column < changed.cols; ++column)
      if (changed(row, column) != 0) bare_(row / kBlocks, column / kBlocks) = 0;
}

/// Removes unchanged pieces that are pressed; returns the number of bare cells. The gel never rises above its
/// level, so that the highest cells tell the level of bare gel.
int BareGelLeveler::find_bare_cells() {
  scratch_.assign(height_.begin(), height_.end());
  highest_ = quantile_in_place(scratch_, 1 - kMinBareShare);
  const float lowest = *std::min_element(scratch_.begin(), scratch_.end());
  const float least = highest_ - std::max(kMaxFall * (highest_ - lowest), kMinFallPx);

  const int pieces = cv::connectedComponents(bare_, labels_, 4, CV_32S);
  std::vector<float> sum(static_cast<std::size_t>(pieces), 0.0F), cells(sum);
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      sum[static_cast<std::size_t>(labels_(row, column))] += height_(row, column);
      ++cells[static_cast<std::size_t>(labels_(row, column))];
    }
  int count = 0;
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      const auto label = static_cast<std::size_t>(labels_(row, column));
      if (label == 0) continue;
      if (sum[label] < least * cells[label])
        bare_(row, column) = 0;
      else
        ++count;
    }
  return count;
}

/// The normal equations by banded Cholesky decomposition, cells numbered along the grid's shorter side.
void BareGelLeveler::solve() {
  correction_.create(grid_);
  const bool by_rows = grid_.width <= grid_.height;
  const int width = std::min(grid_.width, grid_.height), count = grid_.area();
  const int stride = (width / kPanel + 1) * kPanel;
  const auto cell = [&](int i) {
    return by_rows ? cv::Point(i % width, i / width) : cv::Point(i / width, i % width);
  };
  band_.assign(static_cast<std::size_t>(2 * count * stride), 0.0F);
  right_side_.assign(static_cast<std::size_t>(count + stride), 0.0F);
  const auto row = [&](int i) { return band_.data() + 2 * i * stride; };
  const auto variance = [&](cv::Point p) {
    return bare_(p) ? kBareSlopeRad * kBareSlopeRad : changed_variance_(p);
  };
  const auto couple = [&](int a, int b) {  // a < b
    const float weight = 2.0F / (kCellPx * kCellPx * (variance(cell(a)) + variance(cell(b))));
    row(a)[0] += weight;
    row(b)[0] += weight;
    row(a)[b - a] -= weight;
  };
  for (int i = 0; i < count; ++i) {
    if ((i + 1) % width != 0 && i + 1 < count) couple(i, i + 1);
    if (i + width < count) couple(i, i + width);
    if (bare_(cell(i)) == 0) continue;
    constexpr float kWeight = 1.0F / (kBareHeightPx * kBareHeightPx);
    row(i)[0] += kWeight;
    right_side_[static_cast<std::size_t>(i)] = -kWeight * height_(cell(i));
  }
  solve_band(band_.data(), right_side_.data(), count, stride);
  for (int i = 0; i < count; ++i) correction_(cell(i)) = right_side_[static_cast<std::size_t>(i)];
}

void BareGelLeveler::add_correction(cv::Mat1f& height_px) {
  cv::resize(correction_, fine_, cv::Size(grid_.width * kCellSquares, grid_.height * kCellSquares), 0, 0,
             cv::INTER_LINEAR);
  height_px += fine_(cv::Rect(cv::Point(), height_px.size()));
}

BareGelLeveler::Result BareGelLeveler::level(cv::Mat1f& height_px, const cv::Mat1b& changed) {
  average_cells(height_px, changed);
  scratch_.clear();
  if (find_bare_cells() < kMinBareShare * grid_.area()) {
    height_px -= highest_;
    return {};
  }
  solve();
  add_correction(height_px);
  for (int v = 0; v < height_px.rows; v += kCellSquares)
    for (int u = 0; u < height_px.cols; u += kCellSquares / 2)
      if (bare_(v / kCellSquares, u / kCellSquares)) scratch_.push_back(std::abs(height_px(v, u)));
  return {true, 1.4826F * quantile_in_place(scratch_, 0.5)};
}

}  // namespace gelslam::surface::detail
