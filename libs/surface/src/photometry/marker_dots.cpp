#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background.hpp"

namespace gelslam {
namespace {

// Ink takes a third of the light and more; clean gels of four sensors are nowhere 13 % darker than their
// surroundings.
constexpr double kDarkLog = -0.2;
constexpr std::size_t kLeastDots = 9;
// Sizes are those of a 320 pixel wide picture.
constexpr double kSurroundingsPx = 12.0;  // from a quarter to twice of it is a dot's diameter
// Median distance from the median, as a share of it: below 0.1 for printed grids, about 0.4 for specks of
// dirt.
constexpr double kMostSpread = 0.2;

struct Dot {
  double u_px = 0.0, v_px = 0.0, diameter_px = 0.0;
};

/// Logarithm of the brightness against that of the surroundings.
cv::Mat1f darkness(const cv::Mat3b& background, double pixel) {
  cv::Mat1f brightness(background.size());
  std::transform(background.begin(), background.end(), brightness.begin(),
                 [](const cv::Vec3b& c) { return static_cast<float>(std::log(1.0 + c[0] + c[1] + c[2])); });
  cv::Mat1f smooth, broad;
  cv::GaussianBlur(brightness, smooth, cv::Size(), pixel, pixel, cv::BORDER_REPLICATE);
  const double reach = kSurroundingsPx * pixel;
  cv::GaussianBlur(smooth, broad, cv::Size(), reach, reach, cv::BORDER_REPLICATE);
  cv::subtract(smooth, broad, smooth);
  return smooth;
}

std::vector<Dot> find_dots(const cv::Mat3b& background) {
  const double pixel = background.cols / 320.0;
  cv::Mat1b dark;
  cv::compare(darkness(background, pixel), kDarkLog, dark, cv::CMP_LT);
  cv::Mat1i labels, stats;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(dark, labels, stats, centers, 8, CV_32S);
  std::vector<Dot> dots;
  for (int k = 1; k < count; ++k) {
    const double width = stats(k, cv::CC_STAT_WIDTH), height = stats(k, cv::CC_STAT_HEIGHT),
                 area = stats(k, cv::CC_STAT_AREA), diameter = 2.0 * std::sqrt(area / 3.14159265);
    const bool cut = stats(k, cv::CC_STAT_LEFT) == 0 || stats(k, cv::CC_STAT_TOP) == 0 ||
                     stats(k, cv::CC_STAT_LEFT) + width >= background.cols ||
                     stats(k, cv::CC_STAT_TOP) + height >= background.rows;
    if (cut || diameter < kSurroundingsPx * pixel / 4 || diameter > 2 * kSurroundingsPx * pixel) continue;
    dots.push_back({centers(k, 0), centers(k, 1), diameter});
  }
  return dots;
}

double distance_to_nearest(const std::vector<Dot>& dots, std::size_t of) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < dots.size(); ++k)
    if (k != of)
      nearest = std::min(nearest, std::hypot(dots[k].u_px - dots[of].u_px, dots[k].v_px - dots[of].v_px));
  return nearest;
}

/// Median distance from the median, as a share of it.
double spread_of(const std::vector<double>& values, double middle) {
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - middle));
  return median(distances) / middle;
}

}  // namespace

std::string MarkerDots::sentence() const {
  return format_text(
      "the gel has markers (%d dots, %.0f pixels apart): slopes cannot be read through them; use a gel "
      "without markers",
      count, spacing_px);
}

std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background) {
  const std::vector<Dot> dots = find_dots(background);
  if (dots.size() < kLeastDots) return std::nullopt;
  std::vector<double> distances, diameters;
  for (std::size_t k = 0; k < dots.size(); ++k) {
    distances.push_back(distance_to_nearest(dots, k));
    diameters.push_back(dots[k].diameter_px);
  }
  const MarkerDots markers{static_cast<int>(dots.size()), median(distances), median(diameters)};
  if (spread_of(distances, markers.spacing_px) > kMostSpread ||
      spread_of(diameters, markers.diameter_px) > kMostSpread)
    return std::nullopt;
  return markers;
}

}  // namespace gelslam
