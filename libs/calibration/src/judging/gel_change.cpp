#include "judging/gel_change.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/median.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr int kSurfaceDegree = 4, kSurfacePasses = 12;
constexpr double kSurfaceRobustLevels = 3.0, kStandsOutLevels = 10.0;
constexpr int kBorderCells = 3;  // lamps and the gel's frame

/// Powers x^p y^q of every cell's place, one row per cell.
cv::Mat1d powers_of_places(const cv::Size& size) {
  constexpr int terms = (kSurfaceDegree + 1) * (kSurfaceDegree + 2) / 2;
  cv::Mat1d powers(size.area(), terms);
  for (int row = 0; row < size.height; ++row)
    for (int column = 0; column < size.width; ++column) {
      const double x = 2.0 * column / size.width - 1.0, y = 2.0 * row / size.height - 1.0;
      int term = 0;
      for (int p = 0; p <= kSurfaceDegree; ++p)
        for (int q = 0; p + q <= kSurfaceDegree; ++q)
          powers(row * size.width + column, term++) = std::pow(x, p) * std::pow(y, q);
    }
  return powers;
}

}  // namespace

cv::Scalar median_color(const cv::Mat3f& colors) {
  cv::Scalar middle;
  std::vector<double> values(colors.total());
  for (int channel = 0; channel < 3; ++channel) {
    std::transform(colors.begin(), colors.end(), values.begin(),
                   [&](const cv::Vec3f& color) { return static_cast<double>(color[channel]); });
    middle[channel] = median(values);
  }
  return middle;
}

cv::Mat3f shrink_to_cells(const cv::Mat3b& bgr) {
  cv::Mat3f precise, cells;
  bgr.convertTo(precise, CV_32F);
  const int rows = std::max(4, static_cast<int>(std::lround(double{kCellsAcross} * bgr.rows / bgr.cols)));
  cv::resize(precise, cells, cv::Size(kCellsAcross, rows), 0, 0, cv::INTER_AREA);
  return cells;
}

cv::Mat1f cell_difference(const cv::Mat3f& cells, const cv::Mat3f& reference) {
  cv::Mat3f difference;
  cv::subtract(cells, reference, difference);
  difference -= median_color(difference);
  cv::blur(difference, difference, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_REPLICATE);
  return length_of(difference);
}

double common_difference(const cv::Mat3f& cells, const cv::Mat3f& reference) {
  cv::Mat3f difference;
  cv::subtract(cells, reference, difference);
  return cv::norm(median_color(difference));
}

cv::Mat1f length_of(const cv::Mat3f& colors) {
  cv::Mat1f length(colors.size());
  std::transform(colors.begin(), colors.end(), length.begin(),
                 [](const cv::Vec3f& color) { return static_cast<float>(cv::norm(color)); });
  return length;
}

double largest(const cv::Mat1f& map) {
  return static_cast<double>(*std::max_element(map.begin(), map.end()));
}

double level_of_contact(const cv::Mat1f& difference, double touch_level) {
  constexpr double contact_share = 0.3;  // of the largest difference
  return std::max(touch_level, contact_share * largest(difference));
}

std::vector<ChangedPiece> changed_pieces(const cv::Mat1f& difference, double level) {
  cv::Mat1i labels, stats;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(difference > level, labels, stats, centers, 8, CV_32S);
  std::vector<ChangedPiece> pieces;
  for (int label = 1; label < count; ++label) {
    const int left = stats(label, cv::CC_STAT_LEFT), top = stats(label, cv::CC_STAT_TOP);
    const bool at_border = left == 0 || top == 0 || left + stats(label, cv::CC_STAT_WIDTH) == labels.cols ||
                           top + stats(label, cv::CC_STAT_HEIGHT) == labels.rows;
    pieces.push_back({stats(label, cv::CC_STAT_AREA), centers(label, 0), centers(label, 1), 0.0, at_border});
  }
  for (int row = 0; row < labels.rows; ++row)
    for (int column = 0; column < labels.cols; ++column)
      if (const int label = labels(row, column); label > 0)
        pieces[static_cast<std::size_t>(label - 1)].weight += static_cast<double>(difference(row, column));
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const ChangedPiece& a, const ChangedPiece& b) { return a.weight > b.weight; });
  return pieces;
}

int standing_out_cells(const cv::Mat3f& cells) {
  const cv::Mat1d powers = powers_of_places(cells.size());
  cv::Mat1d colors(powers.rows, 3);
  for (int k = 0; k < powers.rows; ++k)
    for (int channel = 0; channel < 3; ++channel)
      colors(k, channel) = static_cast<double>(cells(k / cells.cols, k % cells.cols)[channel]);
  cv::Mat1d weighted = powers.clone(), residual;
  for (int pass = 0; pass < kSurfacePasses; ++pass) {
    cv::Mat1d surface;
    cv::solve(weighted.t() * powers, weighted.t() * colors, surface, cv::DECOMP_CHOLESKY);
    residual = colors - powers * surface;
    for (int k = 0; k < powers.rows; ++k) {
      const double share = cv::norm(residual.row(k)) / kSurfaceRobustLevels;
      weighted.row(k) = powers.row(k) / ((1.0 + share * share) * (1.0 + share * share));
    }
  }
  cv::Mat1f length(cells.size(), 0.0F);
  for (int row = kBorderCells; row < cells.rows - kBorderCells; ++row)
    for (int column = kBorderCells; column < cells.cols - kBorderCells; ++column)
      length(row, column) = static_cast<float>(cv::norm(residual.row(row * cells.cols + column)));
  int most = 0;
  for (const ChangedPiece& piece : changed_pieces(length, kStandsOutLevels))
    most = std::max(most, piece.cells);
  return most;
}

}  // namespace gelslam::calibration::detail
