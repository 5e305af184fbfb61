// Detects what has changed in an image of the gel. The image is averaged over cells, the median change of all
// cells (exposure, light) is subtracted, and connected cells that still differ are returned.

#include "judging/gel_change.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/median.hpp"

namespace gelslam::calibration::detail {

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
  cv::Mat1f length(difference.size());  // norm over the channels
  std::transform(difference.begin(), difference.end(), length.begin(),
                 [](const cv::Vec3f& color) { return static_cast<float>(cv::norm(color)); });
  return length;
}

double largest(const cv::Mat1f& map) {
  return static_cast<double>(*std::max_element(map.begin(), map.end()));
}

std::vector<ChangedPiece> changed_pieces(const cv::Mat1f& difference, double level) {
  cv::Mat1i labels, stats;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(difference > level, labels, stats, centers, 8, CV_32S);
  std::vector<ChangedPiece> pieces;
  for (int label = 1; label < count; ++label)
    pieces.push_back({stats(label, cv::CC_STAT_AREA), centers(label, 0), centers(label, 1), 0.0});
  for (int row = 0; row < labels.rows; ++row)
    for (int column = 0; column < labels.cols; ++column)
      if (const int label = labels(row, column); label > 0)
        pieces[static_cast<std::size_t>(label - 1)].weight += static_cast<double>(difference(row, column));
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const ChangedPiece& a, const ChangedPiece& b) { return a.weight > b.weight; });
  return pieces;
}

}  // namespace gelslam::calibration::detail
