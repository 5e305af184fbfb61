#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "gelslam/calibration/pixel_pitch.hpp"
#include "gelslam/core/median.hpp"
#include "presses/press_fit.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr double kPeriodTolerance = 1.25;  // less than a factor of two: harmonics are other waves
constexpr double kMinPeriods = 4.0;        // in the picture's shorter half
constexpr double kMinStrength = 30.0;      // noise reaches 12 or so, a ruler's marks thousands
constexpr int kPadding = 4;                // of the transform: its bins lie close enough for a parabola
// The lamps shine from other sides at the picture's other end, which shifts the wave by so many periods.
constexpr double kLampShiftPeriods = 0.05;
constexpr double kApartDeg = 30.0;  // waves that tell both axes

struct Frequency {
  double fx = 0.0, fy = 0.0;
};

double length(const Frequency& f) { return std::hypot(f.fx, f.fy); }

/// Power over frequency of a part of a picture's change, windowed so that its border makes no waves.
class Spectrum {
 public:
  explicit Spectrum(const cv::Mat3f& part)
      : power_(cv::Size(cv::getOptimalDFTSize(kPadding * part.cols),
                        cv::getOptimalDFTSize(kPadding * part.rows)),
               0.0F) {
    cv::Mat1f window;
    cv::createHanningWindow(window, part.size(), CV_32F);
    for (int channel = 0; channel < 3; ++channel) {
      cv::Mat1f plane, padded(power_.size(), 0.0F);
      cv::extractChannel(part, plane, channel);
      cv::multiply(plane, window, padded(cv::Rect({0, 0}, plane.size())));
      cv::Mat2f transform;
      cv::dft(padded, transform, cv::DFT_COMPLEX_OUTPUT);
      std::transform(transform.begin(), transform.end(), power_.begin(), power_.begin(),
                     [](const cv::Vec2f& c, float sum) { return sum + c[0] * c[0] + c[1] * c[1]; });
    }
  }

  struct Peak {
    Frequency frequency;
    double strength = 0.0;  ///< over the median of the bins that were looked at
  };
  /// The highest bin where `wanted` is true of its frequency, and the top of the parabolas through it.
  template <class Wanted>
  Peak peak(const Wanted& wanted) const {
    std::vector<double> powers;
    cv::Point at;
    double most = 0.0;
    for (int j = 0; j < power_.rows; ++j)
      for (int i = 0; i <= power_.cols / 2; ++i) {  // the other half is the same
        if (!wanted(frequency(i, j))) continue;
        powers.push_back(static_cast<double>(power_(j, i)));
        if (powers.back() <= most) continue;
        most = powers.back();
        at = {i, j};
      }
    return {frequency(at.x + beyond(at, {1, 0}), at.y + beyond(at, {0, 1})),
            most / std::max(1e-12, median(powers))};
  }

 private:
  Frequency frequency(double i, double j) const {
    return {i / power_.cols, (j < 0.5 * power_.rows ? j : j - power_.rows) / power_.rows};
  }

  /// How far beyond a bin the top lies, in bins: a peak's logarithm is a parabola.
  double beyond(const cv::Point& at, const cv::Point& step) const {
    const auto height = [&](const cv::Point& bin) {
      const float power = power_((bin.y + power_.rows) % power_.rows, (bin.x + power_.cols) % power_.cols);
      return std::log(std::max(1e-12, static_cast<double>(power)));
    };
    const double before = height(at - step), after = height(at + step);
    const double bend = before - 2.0 * height(at) + after;
    return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -1.0, 1.0) : 0.0;
  }

  cv::Mat1f power_;
};

/// What repeats itself within a few periods; broad changes would drown it.
cv::Mat3f without_broad_parts(const cv::Mat3b& bgr, const cv::Mat3b& background, double period_px) {
  cv::Mat3f change = relative_change(bgr, background), broad;
  cv::GaussianBlur(change, broad, cv::Size(), period_px, period_px, cv::BORDER_REPLICATE);
  cv::subtract(change, broad, change);
  return change;
}

bool has_period(const Frequency& f, double period_px) {
  const double periods = length(f) * period_px;
  return periods >= 1.0 / kPeriodTolerance && periods <= kPeriodTolerance;
}

/// How much the halves of the picture, cut across the wave, disagree about it.
double disagreement(const cv::Mat3f& change, const Frequency& f) {
  const bool along_x = std::abs(f.fx) * change.cols > std::abs(f.fy) * change.rows;
  const cv::Size half(along_x ? change.cols / 2 : change.cols, along_x ? change.rows : change.rows / 2);
  const cv::Point second(change.cols - half.width, change.rows - half.height);
  const auto length_in = [&](const cv::Point& first) {
    const auto near = [&](const Frequency& other) {
      return std::abs(other.fx - f.fx) * half.width < 1.0 && std::abs(other.fy - f.fy) * half.height < 1.0;
    };
    return length(Spectrum(change(cv::Rect(first, half))).peak(near).frequency);
  };
  return 0.5 * std::abs(length_in({0, 0}) - length_in(second)) / length(f);
}

}  // namespace

double PatternWave::period_px() const { return 1.0 / std::hypot(fx, fy); }

std::optional<PatternWave> find_pattern(const cv::Mat3b& bgr, const cv::Mat3b& background, double period_px) {
  if (!(period_px > 3.0 && kMinPeriods * period_px <= std::min(bgr.cols, bgr.rows))) return std::nullopt;
  const cv::Mat3f change = without_broad_parts(bgr, background, period_px);
  const Spectrum::Peak peak =
      Spectrum(change).peak([&](const Frequency& f) { return has_period(f, period_px); });
  const Frequency& f = peak.frequency;
  if (peak.strength < kMinStrength || !has_period(f, period_px))  // the flank of another wave
    return std::nullopt;
  const double seen_periods = std::abs(f.fx) * bgr.cols + std::abs(f.fy) * bgr.rows;
  const double uncertainty = std::max(disagreement(change, f), kLampShiftPeriods / seen_periods);
  return PatternWave{f.fx, f.fy, uncertainty};
}

double PixelAspect::tolerance() const { return std::max(kMaxUnsquare, 2.0 * uncertainty); }

PixelAspect PixelPitch::aspect() const {
  return {y_mm / x_mm, std::hypot(x_uncertainty_mm / x_mm, y_uncertainty_mm / y_mm)};
}

PixelPitch pitch_from_pattern(const std::vector<PatternWave>& waves, double period_mm) {
  if (waves.empty() || !(period_mm > 0.0)) throw std::invalid_argument("a pattern has waves and a period");
  constexpr double least_uncertainty = 1e-4;  // keeps the weights finite
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double widest_deg = 0.0, shared = 0.0, shared_weight = 0.0;
  for (const PatternWave& wave : waves) {
    // In units of the period: squared frequencies times the inverse squares of the pitches make 1.
    const Eigen::Vector2d row(std::pow(wave.fx * period_mm, 2), std::pow(wave.fy * period_mm, 2));
    const double weight = 1.0 / std::pow(2.0 * std::max(least_uncertainty, wave.uncertainty), 2);
    information += weight * row * row.transpose();
    right += weight * row;
    shared += weight * std::sqrt(row.sum());
    shared_weight += weight;
    const double angle = std::atan2(std::abs(wave.fy), wave.fx),
                 first = std::atan2(std::abs(waves.front().fy), waves.front().fx);
    widest_deg = std::max(widest_deg, std::abs(angle - first) * 180.0 / std::numbers::pi);
  }
  if (widest_deg < kApartDeg) {
    const double pitch_mm = shared / shared_weight,
                 uncertainty_mm = 0.5 * pitch_mm / std::sqrt(shared_weight);
    return {pitch_mm, pitch_mm, uncertainty_mm, uncertainty_mm, false};
  }
  const Eigen::Matrix2d covariance = information.inverse();
  const Eigen::Vector2d inverse_squares = covariance * right;
  const auto pitch = [&](int axis) { return 1.0 / std::sqrt(std::max(1e-12, inverse_squares[axis])); };
  const auto uncertainty = [&](int axis) {
    return 0.5 * std::pow(pitch(axis), 3) * std::sqrt(covariance(axis, axis));
  };
  return {pitch(0), pitch(1), uncertainty(0), uncertainty(1), true};
}

}  // namespace gelslam
