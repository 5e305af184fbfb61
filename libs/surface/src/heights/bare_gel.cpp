#include "heights/bare_gel.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/median.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr int kCellPx = 8;
constexpr int kReachCells = 3;            // as far as the membrane rim reaches from a contact
constexpr float kBareSlopeRad = 0.01F;    // what unchanged gel may tilt; color changes show more
constexpr float kBestSlopeRad = 0.05F;    // of changed gel where confidence is 255
constexpr float kBareHeightPx = 0.15F;    // 0.01 mm on a GelSight Mini
constexpr double kLeastBareShare = 0.05;  // of the picture; less is no reference
constexpr int kRowStep = 3;               // every third row is plenty for a median

}  // namespace

BareGelLeveler::BareGelLeveler(cv::Size size)
    : size_(size), grid_((size.width + kCellPx - 1) / kCellPx, (size.height + kCellPx - 1) / kCellPx) {
  height_.create(grid_);
  variance_.create(grid_);
  correction_.create(grid_);
  bare_.create(grid_);
}

void BareGelLeveler::average_cells(const cv::Mat1f& height_px, const cv::Mat1b& changed,
                                   const cv::Mat1b& confidence) {
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      const cv::Rect cell =
          cv::Rect(column * kCellPx, row * kCellPx, kCellPx, kCellPx) & cv::Rect(cv::Point(), size_);
      float sum = 0, known = 0;
      int unchanged = 0;
      for (int v = cell.y; v < cell.y + cell.height; ++v)
        for (int u = cell.x; u < cell.x + cell.width; ++u) {
          sum += height_px(v, u);
          unchanged += changed(v, u) == 0;
          known += confidence.empty() ? 255.0F : static_cast<float>(confidence(v, u));
        }
      const auto area = static_cast<float>(cell.area());
      height_(row, column) = sum / area;
      bare_(row, column) = unchanged == cell.area() ? 255 : 0;
      variance_(row, column) = bare_(row, column) ? kBareSlopeRad * kBareSlopeRad
                                                  : kBestSlopeRad * kBestSlopeRad * 255.0F * area / known;
    }
}

/// Removes unchanged pieces that are pressed; returns the number of bare cells.
int BareGelLeveler::find_bare_cells() {
  const int pieces = cv::connectedComponents(bare_, labels_, 4, CV_32S);
  std::vector<float> rise(static_cast<std::size_t>(pieces), 0.0F);  // on the way out, over all of its border
  const auto add_border = [&](cv::Point a, cv::Point b) {
    const int label_a = labels_(a), label_b = labels_(b);
    if (label_a == label_b) return;
    const float step = height_(b) - height_(a);
    rise[static_cast<std::size_t>(label_a)] += step;
    rise[static_cast<std::size_t>(label_b)] -= step;
  };
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      if (column + kReachCells < grid_.width) add_border({column, row}, {column + kReachCells, row});
      if (row + kReachCells < grid_.height) add_border({column, row}, {column, row + kReachCells});
    }
  int count = 0;
  for (int row = 0; row < grid_.height; ++row)
    for (int column = 0; column < grid_.width; ++column) {
      const int label = labels_(row, column);
      if (label == 0) continue;
      if (rise[static_cast<std::size_t>(label)] > 0)
        bare_(row, column) = 0;
      else
        ++count;
    }
  return count;
}

using Vector = Eigen::Map<const Eigen::VectorXf>;

/// The normal equations by banded Cholesky decomposition, cells numbered along the grid's shorter side.
void BareGelLeveler::solve() {
  const bool by_rows = grid_.width <= grid_.height;
  const int width = std::min(grid_.width, grid_.height), count = grid_.area(), stride = width + 1;
  const auto cell = [&](int i) {
    return by_rows ? cv::Point(i % width, i / width) : cv::Point(i / width, i % width);
  };
  band_.assign(static_cast<std::size_t>(count * stride), 0.0F);  // row i holds columns i - width .. i
  right_side_.assign(static_cast<std::size_t>(count), 0.0F);
  const auto at = [&](int i, int j) -> float& {
    return band_[static_cast<std::size_t>(i * stride + j - i + width)];
  };
  const auto couple = [&](int a, int b) {  // a < b
    const float weight = 2.0F / (kCellPx * kCellPx * (variance_(cell(a)) + variance_(cell(b))));
    at(a, a) += weight;
    at(b, b) += weight;
    at(b, a) -= weight;
  };
  for (int i = 0; i < count; ++i) {
    if ((i + 1) % width != 0 && i + 1 < count) couple(i, i + 1);
    if (i + width < count) couple(i, i + width);
    if (bare_(cell(i)) == 0) continue;
    constexpr float kWeight = 1.0F / (kBareHeightPx * kBareHeightPx);
    at(i, i) += kWeight;
    right_side_[static_cast<std::size_t>(i)] = -kWeight * height_(cell(i));
  }
  for (int i = 0; i < count; ++i) {
    const int first = std::max(0, i - width);
    float* row = &at(i, first);
    for (int j = first; j <= i; ++j) {
      const int common = std::max(first, j - width);
      const float* a = &at(i, common);
      const float* b = &at(j, common);
      const float sum = row[j - first] - Vector(a, j - common).dot(Vector(b, j - common));
      row[j - first] = j < i ? sum / at(j, j) : std::sqrt(sum);
    }
  }
  for (int i = 0; i < count; ++i) {
    float sum = right_side_[static_cast<std::size_t>(i)];
    for (int j = std::max(0, i - width); j < i; ++j)
      sum -= at(i, j) * right_side_[static_cast<std::size_t>(j)];
    right_side_[static_cast<std::size_t>(i)] = sum / at(i, i);
  }
  for (int i = count - 1; i >= 0; --i) {
    const float value = right_side_[static_cast<std::size_t>(i)] /= at(i, i);
    for (int j = std::max(0, i - width); j < i; ++j)
      right_side_[static_cast<std::size_t>(j)] -= at(i, j) * value;
    correction_(cell(i)) = value;
  }
}

void BareGelLeveler::add_correction(cv::Mat1f& height_px) {
  cv::resize(correction_, fine_, cv::Size(grid_.width * kCellPx, grid_.height * kCellPx), 0, 0,
             cv::INTER_LINEAR);
  height_px += fine_(cv::Rect(cv::Point(), size_));
}

BareGelLeveler::Result BareGelLeveler::level(cv::Mat1f& height_px, const cv::Mat1b& changed,
                                             const cv::Mat1b& confidence) {
  average_cells(height_px, changed, confidence);
  scratch_.clear();
  if (find_bare_cells() < kLeastBareShare * grid_.area()) {
    for (int v = 0; v < height_px.rows; ++v)
      scratch_.insert(scratch_.end(), height_px[v], height_px[v] + height_px.cols);
    height_px -= quantile_in_place(scratch_, 0.85);
    return {};
  }
  solve();
  add_correction(height_px);
  for (int v = 0; v < height_px.rows; v += kRowStep)
    for (int u = 0; u < height_px.cols; ++u)
      if (bare_(v / kCellPx, u / kCellPx)) scratch_.push_back(std::abs(height_px(v, u)));
  return {true, 1.4826F * quantile_in_place(scratch_, 0.5)};
}

}  // namespace gelslam::surface::detail
