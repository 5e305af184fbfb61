// Finds the dots that are printed on some gels (markers), in a picture of the bare gel. This step is not in
// the papers. Spots that are darker than their surroundings are found by a difference of Gaussians of the
// logarithm of brightness. They are taken for printed dots if at least nine of them have similar diameters
// and similar distances to their nearest neighbors; specks of dirt do not.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/median.hpp"
#include "gelslam/surface/background.hpp"
#include "photometry/pixel_repair.hpp"

namespace gelslam {
namespace {

// The logarithm of the ratio between the brightness of a pixel and that of its surroundings, below which the
// pixel is dark. Ink absorbs at least a third of the light. Clean gels of four sensors are nowhere more than
// 13 % darker (-0.14) than their surroundings.
constexpr double kDarkLog = -0.2;
constexpr std::size_t kMinDots = 9;
// The standard deviation of the Gaussian that averages the surroundings, in pixels of a picture that is 320
// pixels wide. The diameter of a dot may be from a quarter of it to twice as much.
constexpr double kSurroundingsPx = 12.0;
// The largest median absolute deviation of the diameters, and of the distances, relative to their median. It
// is below 0.1 for printed grids and about 0.4 for specks of dirt.
constexpr double kMaxSpread = 0.2;
// If the dots cover more than this fraction of the picture, the gaps between them are narrower than the dots.
constexpr double kMaxCovered = 0.4;

struct Dot {
  double u_px = 0.0, v_px = 0.0, diameter_px = 0.0;
};

/// Returns for each pixel the logarithm of its brightness divided by that of its surroundings. `pixel`: the
/// width in pixels that one pixel of a 320 pixel wide picture has here.
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

std::vector<Dot> find_dots(const cv::Mat3b& background, const cv::Mat1b& dark) {
  const double pixel = background.cols / 320.0;
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

/// Returns the median absolute deviation of the values from their median, `middle`, divided by it.
double spread_of(const std::vector<double>& values, double middle) {
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - middle));
  return median(distances) / middle;
}

}  // namespace

std::string MarkerDots::sentence() const {
  if (!are_readable())
    return fmt::format(
        "the gel has {} markers, {:.0f} pixels apart, that cover {:.0f} % of it: too little is left to read "
        "slopes from; use a gel with fewer markers or none",
        count, spacing_px, 100 * covered_share);
  return fmt::format(
      "the gel has {} markers, {:.0f} pixels apart; their pixels are filled in: a gel without them measures "
      "more",
      count, spacing_px);
}

bool MarkerDots::are_readable() const { return covered_share <= kMaxCovered; }

std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background) {
  const cv::Mat1b dark(darkness(background, background.cols / 320.0) < kDarkLog);
  const std::vector<Dot> dots = find_dots(background, dark);
  if (dots.size() < kMinDots) return std::nullopt;
  std::vector<double> distances, diameters;
  for (std::size_t k = 0; k < dots.size(); ++k) {
    distances.push_back(distance_to_nearest(dots, k));
    diameters.push_back(dots[k].diameter_px);
  }
  MarkerDots markers{static_cast<int>(dots.size()), median(distances), median(diameters)};
  if (spread_of(distances, markers.spacing_px) > kMaxSpread ||
      spread_of(diameters, markers.diameter_px) > kMaxSpread)
    return std::nullopt;
  for (const Dot& dot : dots) markers.centers_px.emplace_back(dot.u_px, dot.v_px);
  surface::detail::spread_spots(dark, markers.mask);
  markers.covered_share =
      cv::countNonZero(markers.mask) / static_cast<double>(std::max<std::size_t>(1, background.total()));
  return markers;
}

MarkerFiller::MarkerFiller(const cv::Mat3b& background) : background_(background) {
  if (!find_marker_dots(background)) return;
  repair_ = std::make_unique<surface::detail::PixelRepair>(background);
  background_ = repair_->background();
}

MarkerFiller::~MarkerFiller() = default;

cv::Mat3b MarkerFiller::fill(const cv::Mat3b& bgr, cv::Mat1b& covered) const {
  covered.release();
  if (!repair_) return bgr;
  cv::Mat3b filled = repair_->clean(bgr).clone();
  covered = repair_->covered().clone();
  return filled;
}

}  // namespace gelslam
