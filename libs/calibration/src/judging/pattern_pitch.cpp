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
constexpr int kPadding = 2;                // of the transform, so that no peak falls between its bins
// The lamps shine from other sides at the picture's other end, which shifts the wave by so many periods.
constexpr double kLampShiftPeriods = 0.05;
constexpr double kApartDeg = 30.0;  // waves that tell both axes

struct Frequency {
  double fx = 0.0, fy = 0.0;
};

/// A part of a picture's change, windowed so that its border makes no waves; power of any frequency in it.
class Spectrum {
 public:
  Spectrum(const cv::Mat3f& change, const cv::Rect& part) : part_(change(part).clone()) {
    cv::Mat1d window;
    cv::createHanningWindow(window, part.size(), CV_64F);
    for (int v = 0; v < part_.rows; ++v)
      for (int u = 0; u < part_.cols; ++u) part_(v, u) *= static_cast<float>(window(v, u));
  }

  /// Power at the bins of a discrete transform, frequency (i, j) / size.
  cv::Mat1f bins(cv::Size& size) const {
    size = {cv::getOptimalDFTSize(kPadding * part_.cols), cv::getOptimalDFTSize(kPadding * part_.rows)};
    cv::Mat1f power(size, 0.0F);
    for (int channel = 0; channel < 3; ++channel) {
      cv::Mat1f padded(size, 0.0F);
      cv::Mat1f plane;
      cv::extractChannel(part_, plane, channel);
      plane.copyTo(padded(cv::Rect({0, 0}, plane.size())));
      cv::Mat2f transform;
      cv::dft(padded, transform, cv::DFT_COMPLEX_OUTPUT);
      std::transform(transform.begin(), transform.end(), power.begin(), power.begin(),
                     [](const cv::Vec2f& c, float sum) { return sum + c[0] * c[0] + c[1] * c[1]; });
    }
    return power;
  }

  double power(const Frequency& f) const {
    const std::vector<cv::Vec2d> along = turns(f.fx, part_.cols), down = turns(f.fy, part_.rows);
    cv::Vec3d real(0, 0, 0), imaginary(0, 0, 0);
    for (int v = 0; v < part_.rows; ++v) {
      cv::Vec3d row_real(0, 0, 0), row_imaginary(0, 0, 0);
      for (int u = 0; u < part_.cols; ++u) {
        const cv::Vec3d value = part_(v, u);
        row_real += value * along[static_cast<std::size_t>(u)][0];
        row_imaginary += value * along[static_cast<std::size_t>(u)][1];
      }
      const cv::Vec2d& turn = down[static_cast<std::size_t>(v)];
      real += row_real * turn[0] - row_imaginary * turn[1];
      imaginary += row_real * turn[1] + row_imaginary * turn[0];
    }
    return real.dot(real) + imaginary.dot(imaginary);
  }

  /// The top of the peak that `f` lies on: parabolas through three points per axis, ever closer.
  Frequency top(Frequency f) const {
    double step_x = 0.5 / part_.cols, step_y = 0.5 / part_.rows;
    for (int round = 0; round < 12; ++round) {
      const double here = power(f);
      f.fx += step_x * towards_top(power({f.fx - step_x, f.fy}), here, power({f.fx + step_x, f.fy}));
      f.fy += step_y * towards_top(power({f.fx, f.fy - step_y}), here, power({f.fx, f.fy + step_y}));
      step_x *= 0.6;
      step_y *= 0.6;
    }
    return f;
  }

 private:
  static std::vector<cv::Vec2d> turns(double frequency, int count) {
    std::vector<cv::Vec2d> result;
    for (int k = 0; k < count; ++k) {
      const double angle = -2.0 * std::numbers::pi * frequency * k;
      result.emplace_back(std::cos(angle), std::sin(angle));
    }
    return result;
  }

  /// In steps, at most one.
  static double towards_top(double before, double here, double after) {
    const double bend = before - 2.0 * here + after;
    if (bend >= 0.0) return after > before ? 1.0 : -1.0;
    return std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
  }

  cv::Mat3f part_;
};

/// What repeats itself within a few periods; broad changes would drown it.
cv::Mat3f without_broad_parts(const cv::Mat3b& bgr, const cv::Mat3b& background, double period_px) {
  cv::Mat3f change = relative_change(press_change(bgr, background), background), broad;
  cv::GaussianBlur(change, broad, cv::Size(), period_px, period_px, cv::BORDER_REPLICATE);
  cv::subtract(change, broad, change);
  return change;
}

double length(const Frequency& f) { return std::hypot(f.fx, f.fy); }

/// The strongest bin with about the wanted period, and how it stands out among those.
struct Peak {
  Frequency frequency;
  double strength = 0.0;
};
Peak strongest(const Spectrum& spectrum, double period_px) {
  cv::Size size;
  const cv::Mat1f power = spectrum.bins(size);
  std::vector<double> around;
  Peak peak;
  double most = 0.0;
  for (int j = 0; j < size.height; ++j)
    for (int i = 0; i <= size.width / 2; ++i) {  // the other half is the same
      const Frequency f{static_cast<double>(i) / size.width,
                        static_cast<double>(j < size.height / 2 ? j : j - size.height) / size.height};
      const double periods = length(f) * period_px;
      if (periods < 1.0 / kPeriodTolerance || periods > kPeriodTolerance) continue;
      around.push_back(static_cast<double>(power(j, i)));
      if (around.back() <= most) continue;
      most = around.back();
      peak.frequency = f;
    }
  peak.strength = most / std::max(1e-12, median(around));
  return peak;
}

/// How much the halves of the picture, cut across the wave, disagree about it.
double disagreement(const cv::Mat3f& change, const Frequency& f) {
  const bool along_x = std::abs(f.fx) * change.cols > std::abs(f.fy) * change.rows;
  const cv::Size half(along_x ? change.cols / 2 : change.cols, along_x ? change.rows : change.rows / 2);
  const cv::Point second(change.cols - half.width, change.rows - half.height);
  const double a = length(Spectrum(change, {{0, 0}, half}).top(f)),
               b = length(Spectrum(change, {second, half}).top(f));
  return 0.5 * std::abs(a - b) / length(f);
}

}  // namespace

double PatternWave::period_px() const { return 1.0 / std::hypot(fx, fy); }

std::optional<PatternWave> find_pattern(const cv::Mat3b& bgr, const cv::Mat3b& background, double period_px) {
  if (!(period_px > 3.0 && kMinPeriods * period_px <= std::min(bgr.cols, bgr.rows))) return std::nullopt;
  const cv::Mat3f change = without_broad_parts(bgr, background, period_px);
  const Spectrum spectrum(change, {{0, 0}, change.size()});
  const Peak peak = strongest(spectrum, period_px);
  if (peak.strength < kMinStrength) return std::nullopt;
  Frequency f = spectrum.top(peak.frequency);
  const double periods = length(f) * period_px;
  if (periods < 1.0 / kPeriodTolerance || periods > kPeriodTolerance)
    return std::nullopt;  // the flank of another wave
  if (f.fx < 0.0) f = {-f.fx, -f.fy};
  const double seen_periods = std::abs(f.fx) * bgr.cols + std::abs(f.fy) * bgr.rows;
  const double uncertainty = std::max(disagreement(change, f), kLampShiftPeriods / seen_periods);
  return PatternWave{f.fx, f.fy, uncertainty, peak.strength};
}

bool pixels_are_square(double y_over_x, double uncertainty) {
  return std::abs(y_over_x - 1.0) <= std::max(kMaxUnsquare, 2.0 * uncertainty);
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
