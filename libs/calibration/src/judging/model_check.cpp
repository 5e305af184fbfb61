#include "gelslam/calibration/model_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "gelslam/calibration/ball_fit.hpp"
#include "gelslam/calibration/press_depth.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {
namespace {

const cv::Size error_cells{16, 12};

// Read from models of four sensors: a fresh good calibration stays within the first limits, one from the
// published recipe within the second.
struct Limits {
  double error_deg, gain, radius;
};
constexpr Limits kGoodLimits = {3.0, 0.03, 0.03}, kUsableLimits = {5.0, 0.10, 0.08};
constexpr double kOddNinthGain = 0.15;  // of one ninth, worth a sentence
constexpr double kMinNinthPixels = 1500;

std::string formatted(const char* format, double a, double b = 0.0) {
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

struct ErrorMap {
  cv::Mat1d sum{error_cells, 0.0}, count{error_cells, 0.0};

  void add(const cv::Point& cell, double error_deg) {
    sum(cell) += error_deg;
    count(cell) += 1.0;
  }
  cv::Mat1f mean() const {
    cv::Mat1f result(error_cells, std::numeric_limits<float>::quiet_NaN());
    for (int row = 0; row < result.rows; ++row)
      for (int column = 0; column < result.cols; ++column)
        if (count(row, column) > 0.0)
          result(row, column) = static_cast<float>(sum(row, column) / count(row, column));
    return result;
  }
};

void add_to_map(const std::vector<ZoneReading>& pixels, const cv::Size& size, ErrorMap& map) {
  for (const ZoneReading& pixel : pixels) {
    const double error = 0.5 * (std::abs(std::atan(pixel.read[0]) - std::atan(pixel.truth[0])) +
                                std::abs(std::atan(pixel.read[1]) - std::atan(pixel.truth[1])));
    map.add({pixel.u * error_cells.width / size.width, pixel.v * error_cells.height / size.height},
            error * 180.0 / 3.14159265358979);
  }
}

const char* place_name(std::size_t ninth) {
  constexpr std::array<const char*, 9> names = {"upper left",  "upper middle", "upper right",
                                                "middle left", "middle",       "middle right",
                                                "lower left",  "lower middle", "lower right"};
  return names[ninth];
}

Verdict worse(Verdict a, Verdict b) { return std::max(a, b); }

Verdict judge_number(double value, double good_limit, double usable_limit) {
  if (std::abs(value) <= good_limit) return Verdict::good;
  return std::abs(value) <= usable_limit ? Verdict::usable : Verdict::recalibrate;
}

void judge(ModelCheck& check, const std::vector<double>& rim_slopes) {
  std::vector<std::pair<Verdict, std::string>> found;
  const auto note = [&](Verdict verdict, std::string reason) {
    if (verdict != Verdict::good) found.emplace_back(verdict, std::move(reason));
  };
  const double error = check.errors.all.mean_abs_error_deg();
  note(judge_number(error, kGoodLimits.error_deg, kUsableLimits.error_deg),
       formatted("slopes are wrong by %.1f degrees on average", error));
  const double gain = check.gains.all.gain();
  note(judge_number(gain - 1.0, kGoodLimits.gain, kUsableLimits.gain),
       formatted(gain > 1.0 ? "slopes read %.0f %% too steep" : "slopes read %.0f %% too flat",
                 100.0 * std::abs(gain - 1.0)));
  for (const DiameterCheck& ball : check.diameters)
    note(judge_number(ball.radius_error(), kGoodLimits.radius, kUsableLimits.radius),
         formatted("balls of %.2f mm come out %+.1f %% in radius", ball.diameter_mm,
                   100.0 * ball.radius_error()));
  for (std::size_t k = 0; k < 9; ++k) {
    const SlopeSums& ninth = check.gains.ninths[k];
    if (ninth.pixels < kMinNinthPixels || std::abs(ninth.gain() - 1.0) < kOddNinthGain) continue;
    note(Verdict::usable,
         std::string("at the ") + place_name(k) + " of the gel " +
             formatted(ninth.gain() > 1.0 ? "slopes read %.0f %% too steep" : "slopes read %.0f %% too flat",
                       100.0 * std::abs(ninth.gain() - 1.0)));
  }
  if (std::string missing = missing_depths(rim_slopes); !missing.empty())
    note(Verdict::usable, std::move(missing));
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  check.verdict = Verdict::good;
  for (auto& [verdict, reason] : found) {
    check.verdict = worse(check.verdict, verdict);
    check.reasons.push_back(std::move(reason));
  }
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  return verdict == Verdict::good ? "good" : verdict == Verdict::usable ? "usable" : "recalibrate";
}

ModelCheck check_model(const GradientModel& model, const PressSet& set, const std::vector<BallZone>& zones,
                       double pixel_pitch_mm, const std::function<void(std::size_t)>& progress) {
  if (zones.empty()) throw Error("'" + set.folder.string() + "': no press can be used to check a model");
  SurfaceOptions options;
  options.pixel_pitch_mm = pixel_pitch_mm;
  // What a press does to the colors around it would be taken for a change of light (1 % of a real ball's
  // radius), and single pictures have no light to follow from one to the next.
  options.compensate_light = false;
  SurfaceEstimator estimator(model, set.background, options);
  ModelCheck check;
  ErrorMap map;
  std::vector<double> rim_slopes;
  struct Size {
    std::vector<double> radii_mm;
    SlopeSums slopes;
    std::size_t presses = 0;
  };
  std::map<double, Size> sizes;
  for (const BallZone& zone : zones) {
    const CalibrationPress& press = set.presses[zone.press];
    rim_slopes.push_back(rim_slope(zone.radius_px, 0.5 * press.diameter_mm / pixel_pitch_mm));
    const std::vector<ZoneReading> labelled = read_zone(model, set, zone, pixel_pitch_mm, false);
    const SlopeStatistics errors = statistics_of(labelled, press.bgr.size());
    const SlopeStatistics gains =
        statistics_of(read_zone(model, set, zone, pixel_pitch_mm, true), press.bgr.size());
    check.errors.add(errors);
    check.gains.add(gains);
    add_to_map(labelled, press.bgr.size(), map);
    const SurfacePtr surface = estimator.estimate(press.bgr);
    const auto radius_mm = fit_ball_radius_mm(*surface, zone, 0.5 * press.diameter_mm);
    check.presses.push_back({zone, errors.all.mean_abs_error_deg(), radius_mm});
    Size& size = sizes[press.diameter_mm];
    size.slopes.add(gains.all);
    ++size.presses;
    if (radius_mm) size.radii_mm.push_back(*radius_mm);
    if (progress) progress(check.presses.size());
  }
  for (const auto& [diameter_mm, size] : sizes)
    check.diameters.push_back({diameter_mm, size.presses, median(size.radii_mm), size.slopes.gain()});
  check.error_map_deg = map.mean();
  judge(check, rim_slopes);
  return check;
}

}  // namespace gelslam
