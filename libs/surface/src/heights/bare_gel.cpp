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

constexpr int kCellPx = 2 * kBlockPx;      // the side of a cell
constexpr int kCellSquares = kCellPx / 2;  // the side of a cell in 2x2-pixel squares of PoissonSolver
// The standard deviation of the slope in a cell of unchanged color, and of the height of bare gel.
constexpr float kBareSlopeRad = 0.01F;
constexpr double kBareHeightMm = 0.00951;
// The length over which the errors of slopes are correlated.
constexpr double kSlopePatchMm = 0.5072;
// If less than this fraction of the picture is bare gel, it cannot serve as the reference of the heights.
constexpr double kMinBareShare = 0.01;
// The slope at which the error of a slope in a contact has the standard deviation of changed_variance_.
constexpr float kUsualSlopeRad = 0.25F;
// If the slopes on one flank of a contact are read too flat, the bare gel beyond it is integrated too low, by
// at most this fraction of the depth of the contact or 0.02 mm, whichever is larger. With a model of another
// sensor the error is up to four times as large (slope_sigma_ratio). Gel below that limit is pressed.
constexpr float kMaxFall = 0.11F;
constexpr double kMinFallMm = 0.01902;
// For gel that was bare in the frame before, the limit is larger by this factor. Otherwise the result could
// alternate between frames in which nothing moves. Even with a model of another sensor, the field of a coin,
// which lies at half of the depth of its rim, is lower by 1.25 times the limit, so it is recognized as
// pressed.
constexpr float kStaysBare = 1.2F;

constexpr int kPanel = 4 * kLanes;  // the number of columns for which the vector registers suffice

/// Solves A x = b for a symmetric, positive definite band matrix A by Cholesky decomposition, in place. Row i
/// of `band` has 2 stride numbers: the elements of A in the columns i to i + stride - 1, then zeros. `x`
/// holds the `count` elements of b, which become those of x, and then `stride` zeros.
GELSLAM_CLONES void solve_band(float* band, float* x, int count, int stride) {
  for (int i = 0; i < count; ++i) {
    float* const row = band + 2 * i * stride;
    for (float* part = row; part != row + stride; part += kPanel) {
      // Two independent sums, because a processor can add to one while it waits for the other. The row that
      // was computed last is subtracted last.
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

BareGelLeveler::BareGelLeveler(const CameraModel& camera, const cv::Mat1b& confidence,
                               double slope_noise_ratio, double slope_sigma_ratio)
    : grid_((camera.size.width + kCellPx - 1) / kCellPx, (camera.size.height + kCellPx - 1) / kCellPx),
      noise_(static_cast<float>(slope_noise_ratio)),
      slope_error_(static_cast<float>(slope_sigma_ratio)),
      bare_height_px_(static_cast<float>(kBareHeightMm / camera.pitch_mm)),
      min_fall_px_(static_cast<float>(kMinFallMm / camera.pitch_mm)),
      slope_patch_px_(static_cast<float>(kSlopePatchMm / camera.pitch_mm)),
      changed_variance_(grid_, static_cast<float>(kBestSlopeSigmaRad * kBestSlopeSigmaRad)),
      were_bare_(grid_, static_cast<unsigned char>(0)) {
  if (confidence.empty()) return;
  cv::Mat1f known;
  confidence.convertTo(known, CV_32F, 1.0 / 255);
  cv::resize(known, known, grid_, 0, 0, cv::INTER_AREA);
  cv::divide(changed_variance_, known, changed_variance_);
}

void BareGelLeveler::mark_unchanged(const cv::Mat1b& changed) {
  bare_.create(grid_);
  bare_.setTo(255);
  constexpr int kBlocks = kCellPx / kBlockPx;
  for (int row = 0; row < changed.rows; ++row)
    for (int column = 0; column < changed.cols; ++column)
      if (changed(row, column) != 0) bare_(row / kBlocks, column / kBlocks) = 0;
}

/// Removes from bare_ the connected regions that a flat face presses down, and returns false if there are
/// none. The reference is the height of the highest cells, because gel hardly rises above its level at rest.
/// `heights`: the heights of the cells in pixels, divided by slope_noise_ratio.
bool BareGelLeveler::remove_pressed(const cv::Mat1f& heights) {
  const float highest = highest_of(heights);
  const float lowest = *std::min_element(heights.begin(), heights.end());
  const float fall = slope_error_ * std::max(kMaxFall * (highest - lowest), min_fall_px_);

  struct Piece {
    float height = 0, cells = 0, were_bare = 0;  // sums over the cells of a connected region
  };
  std::vector<Piece> pieces(static_cast<std::size_t>(cv::connectedComponents(bare_, labels_, 4, CV_32S)));
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      Piece& piece = pieces[static_cast<std::size_t>(labels_(row, column))];
      piece.height += heights(row, column);
      ++piece.cells;
      if (were_bare_(row, column) != 0) ++piece.were_bare;
    }
  const auto is_pressed = [&](const Piece& piece) {
    const float limit = 2 * piece.were_bare > piece.cells ? kStaysBare * fall : fall;
    return piece.height < (highest - limit) * piece.cells;
  };
  bool removed = false;
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      const auto label = static_cast<std::size_t>(labels_(row, column));
      if (label == 0 || !is_pressed(pieces[label])) continue;
      bare_(row, column) = 0;
      removed = true;
    }
  return removed;
}

/// Computes the mean of the squares in each cell, divided by slope_noise_ratio, so that the constants above
/// hold for every model. The last row and column of cells may reach beyond the picture.
void BareGelLeveler::shrink_to_cells(const cv::Mat1f& squares, cv::Mat1f& cells) {
  cv::copyMakeBorder(squares, fine_, 0, grid_.height * kCellSquares - squares.rows, 0,
                     grid_.width * kCellSquares - squares.cols, cv::BORDER_REPLICATE);
  cv::resize(fine_, cells, grid_, 0, 0, cv::INTER_AREA);
  cells /= noise_;
}

/// Returns the 99th percentile of the heights.
float BareGelLeveler::highest_of(const cv::Mat1f& heights) {
  scratch_.assign(heights.begin(), heights.end());
  return quantile_in_place(scratch_, 1 - kMinBareShare);
}

/// Integrates the heights of the cells by weighted least squares, up to a constant. The standard deviation of
/// a slope is taken to be proportional to the slope (plus that of bare gel).
cv::Mat1f BareGelLeveler::integrate_where_flat(const LineHeights& lines) {
  LineHeights steps;
  shrink_to_cells(lines.along_rows, steps.along_rows);
  shrink_to_cells(lines.along_columns, steps.along_columns);
  cv::Mat1f variance(grid_);
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      const int left = std::max(column - 1, 0), right = std::min(column + 1, grid_.width - 1),
                above = std::max(row - 1, 0), below = std::min(row + 1, grid_.height - 1);
      const float x = (steps.along_rows(row, right) - steps.along_rows(row, left)) /
                      static_cast<float>(kCellPx * (right - left)),
                  y = (steps.along_columns(below, column) - steps.along_columns(above, column)) /
                      static_cast<float>(kCellPx * (below - above));
      variance(row, column) = kBareSlopeRad * kBareSlopeRad + changed_variance_(row, column) *
                                                                  (x * x + y * y) /
                                                                  (kUsualSlopeRad * kUsualSlopeRad);
    }
  constexpr float kHardly = 1e-4F;  // a small weight of bare cells, which makes the solution unique
  return solve(steps, variance, kHardly, cv::Mat1f(grid_, 0.0F));
}

/// Solves for the heights of the cells by weighted least squares. The measured height differences between
/// neighbors are the differences of `steps`, and their variances follow from `variance`, that of the slope in
/// each cell. Bare cells have the measured height `bare_height` with the weight `bare_weight`. The normal
/// equations are solved by banded Cholesky decomposition; the cells are numbered along the shorter side of
/// the grid, which makes the band narrow.
cv::Mat1f BareGelLeveler::solve(const LineHeights& steps, const cv::Mat1f& variance, float bare_weight,
                                const cv::Mat1f& bare_height) {
  const bool by_rows = grid_.width <= grid_.height;
  const int width = std::min(grid_.width, grid_.height), count = grid_.area();
  const int stride = (width / kPanel + 1) * kPanel;
  const auto cell = [&](int i) {
    return by_rows ? cv::Point(i % width, i / width) : cv::Point(i / width, i % width);
  };
  band_.assign(static_cast<std::size_t>(2 * count * stride), 0.0F);
  right_side_.assign(static_cast<std::size_t>(count + stride), 0.0F);
  const auto row = [&](int i) { return band_.data() + 2 * i * stride; };
  const auto couple = [&](int a, int b) {  // a < b
    const cv::Point from = cell(a), to = cell(b);
    const cv::Mat1f& line = from.y == to.y ? steps.along_rows : steps.along_columns;
    const float weight = 2.0F / (kCellPx * slope_patch_px_ * (variance(from) + variance(to)));
    const float pull = weight * (line(to) - line(from));
    row(a)[0] += weight;
    row(b)[0] += weight;
    row(a)[b - a] -= weight;
    right_side_[static_cast<std::size_t>(a)] -= pull;
    right_side_[static_cast<std::size_t>(b)] += pull;
  };
  for (int i = 0; i < count; ++i) {
    if ((i + 1) % width != 0 && i + 1 < count) couple(i, i + 1);
    if (i + width < count) couple(i, i + width);
    if (bare_(cell(i)) == 0) continue;
    row(i)[0] += bare_weight;
    right_side_[static_cast<std::size_t>(i)] += bare_weight * bare_height(cell(i));
  }
  solve_band(band_.data(), right_side_.data(), count, stride);
  cv::Mat1f result(grid_);
  for (int i = 0; i < count; ++i) result(cell(i)) = right_side_[static_cast<std::size_t>(i)];
  return result;
}

void BareGelLeveler::add_correction(cv::Mat1f& height_px) {
  cv::Mat1f variance = changed_variance_.clone();
  variance.setTo(kBareSlopeRad * kBareSlopeRad, bare_);
  const cv::Mat1f none(grid_, 0.0F);
  const cv::Mat1f correction =
      solve({none, none}, variance, 1.0F / (bare_height_px_ * bare_height_px_), cv::Mat1f(-height_));
  cv::resize(correction, fine_, cv::Size(grid_.width * kCellSquares, grid_.height * kCellSquares), 0, 0,
             cv::INTER_LINEAR);
  height_px += noise_ * fine_(cv::Rect(cv::Point(), height_px.size()));
}

BareGelLeveler::Result BareGelLeveler::level(cv::Mat1f& height_px, const cv::Mat1b& changed,
                                             const PoissonSolver& slopes) {
  shrink_to_cells(height_px, height_);
  mark_unchanged(changed);
  if (remove_pressed(height_)) {
    mark_unchanged(changed);
    remove_pressed(integrate_where_flat(slopes.line_heights()));
  }
  bare_.copyTo(were_bare_);
  if (cv::countNonZero(bare_) < kMinBareShare * grid_.area()) {
    height_px -= noise_ * highest_of(height_);
    return {};
  }
  add_correction(height_px);
  scratch_.clear();
  for (int v = 0; v < height_px.rows; v += kCellSquares)
    for (int u = 0; u < height_px.cols; u += kCellSquares / 2)
      if (bare_(v / kCellSquares, u / kCellSquares)) scratch_.push_back(std::abs(height_px(v, u)));
  return {true, 1.4826F * quantile_in_place(scratch_, 0.5)};
}

}  // namespace gelslam::surface::detail
