#include "photometry/shift_finder.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr int kCellBlocks = 3;
constexpr double kMostShift = 0.15;  // of the width: 48 of 320 pixels
// Cells of bare gel agree with the background within this many gray levels; twice as many, while what is left
// of a change of light is taken out.
constexpr float kCellAgreesLevels = 1.5F;
// Share of the picture that must agree better elsewhere. Of whole pictures of 100 real and rendered logs
// 0.04 at most does; of those shifted by 12 pixels or more, where a tenth of the gel is bare, 0.06 or more.
constexpr double kLeastGain = 0.05;

cv::Mat3f cells_of(const cv::Mat3f& blocks) {
  cv::Mat3f cells;
  cv::resize(blocks, cells, blocks.size() / kCellBlocks, 0, 0, cv::INTER_AREA);
  return cells;
}

/// 1 for every cell that agrees, else 0.
cv::Mat1b agreeing(const cv::Mat3f& cells, const cv::Mat3f& background) {
  cv::Vec3d products(0, 0, 0), squares(0, 0, 0);
  for (auto b = background.begin(), c = cells.begin(); b != background.end(); ++b, ++c) {
    const cv::Vec3f difference = *c - *b;
    if (difference.dot(difference) > 4 * kCellAgreesLevels * kCellAgreesLevels) continue;
    products += cv::Vec3d((*c).mul(*b));
    squares += cv::Vec3d((*b).mul(*b));
  }
  cv::Vec3f gain;
  for (int c = 0; c < 3; ++c) gain[c] = squares[c] > 0 ? static_cast<float>(products[c] / squares[c]) : 1.0F;
  cv::Mat1b agree(cells.size(), 0);
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.cols; ++column) {
      const cv::Vec3f difference = cells(row, column) - gain.mul(background(row, column));
      agree(row, column) = difference.dot(difference) < kCellAgreesLevels * kCellAgreesLevels;
    }
  }
  return agree;
}

/// Of rows next to each other, the most that more cells agree.
int gained(const cv::Mat1b& agree, const cv::Mat1b& before) {
  int most = 0, sum = 0;
  for (int row = 0; row < agree.rows; ++row) {
    sum = std::max(0, sum + cv::countNonZero(agree.row(row)) - cv::countNonZero(before.row(row)));
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

ShiftFinder::ShiftFinder(const cv::Mat3f& background_blocks) {
  const int columns = background_blocks.cols, most = static_cast<int>(kMostShift * columns);
  for (int i = 0; i <= 2 * most; ++i) {
    const int shift = i % 2 == 0 ? i / 2 : -(i + 1) / 2;
    cv::Mat3f rolled(background_blocks.size());
    for (int from = 0; from < columns; ++from)
      background_blocks.col(from).copyTo(rolled.col((from + shift + columns) % columns));
    shifted_.push_back(cells_of(rolled));
    shift_blocks_.push_back(shift);
  }
}

int ShiftFinder::find_px(const cv::Mat3f& blocks) {
  const cv::Mat3f cells = cells_of(blocks);
  const cv::Mat1b unshifted = agreeing(cells, shifted_.front());
  const auto least = static_cast<int>(kLeastGain * static_cast<double>(cells.total()));
  int best = least, shift_blocks = 0;
  // Bare gel that is shifted agrees no more where it agreed before. Few pictures are compared further.
  if (bare_.empty() || cv::countNonZero(bare_ > unshifted) > least) {
    for (std::size_t i = 1; i < shifted_.size(); ++i) {
      const int more = gained(agreeing(cells, shifted_[i]), unshifted);
      if (more > best) {
        best = more;
        shift_blocks = shift_blocks_[i];
      }
    }
  }
  if (shift_blocks == 0) bare_ = unshifted;
  return shift_blocks * kBlockPx;
}

}  // namespace gelslam::surface::detail
