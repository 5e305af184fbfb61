// Estimates the standard deviation of a gradient model's slopes over the image by two-fold cross-validation
// (not in the paper). Each half model reads the presses that it was not trained on. A cell's variance is the
// mean over presses of their mean squared angle error in that cell. The default uncertainty is added as a
// prior with the weight of kDefaultCount presses.

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/calibration/slope_statistics.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

/// Sums of squared angle errors in each cell over the pixels of one press, and their number.
struct CellErrors {
  cv::Mat1d squares{cv::Size(GradientModel::kSigmaColumns, GradientModel::kSigmaRows), 0.0};
  cv::Mat1d count{squares.size(), 0.0};

  void add(const ZoneReading& pixel, cv::Size picture) {
    const cv::Point cell(pixel.u * squares.cols / picture.width, pixel.v * squares.rows / picture.height);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double error = std::atan(pixel.read[axis]) - std::atan(pixel.truth[axis]);
      squares(cell) += error * error;
      count(cell) += 1;
    }
  }
};

constexpr double kMinPressCellPixels = 32;  // Cells with fewer pixels of a press only contain its outline.
// Number of presses with which the default counts. With more, its 0.4 rad at the image border would outweigh
// dozens of presses that were read well.
constexpr double kDefaultCount = 0.02;

}  // namespace

HalfModels train_halves(const PressSet& set, const std::vector<BallZone>& zones,
                        const ModelTraining& training, ProgressSink& progress) {
  ModelTraining half = training;
  half.steps = std::max(1, training.steps / 2);
  HalfModels halves{{}, zones};
  // Zones are sorted by ball first. If two balls alternate in the set, every second zone would otherwise be
  // of the same ball.
  std::ranges::stable_sort(halves.zones, {},
                           [&](const BallZone& zone) { return set.presses[zone.press].diameter_mm; });
  for (const std::size_t held_out : {0, 1}) {
    std::vector<BallZone> taken;
    for (std::size_t k = 1 - held_out; k < zones.size(); k += 2) taken.push_back(halves.zones[k]);
    halves.models[held_out] = train_model(set, taken, half, progress);
  }
  return halves;
}

std::vector<float> held_out_sigma_rad(const HalfModels& halves, const PressSet& set, double pixel_pitch_mm) {
  cv::Mat1d variance;
  default_uncertainty(set.background.size(), pixel_pitch_mm).sigma_rad.convertTo(variance, CV_64F);
  cv::multiply(variance, variance, variance);
  variance *= kDefaultCount;
  cv::Mat1d presses(variance.size(), kDefaultCount);
  for (std::size_t k = 0; k < halves.zones.size(); ++k) {
    CellErrors errors;
    for (const ZoneReading& pixel : read_zone(halves.models[k % 2], set, halves.zones[k], pixel_pitch_mm))
      errors.add(pixel, set.background.size());
    for (int row = 0; row < variance.rows; ++row)
      for (int column = 0; column < variance.cols; ++column) {
        if (errors.count(row, column) < kMinPressCellPixels) continue;
        variance(row, column) += errors.squares(row, column) / errors.count(row, column);
        presses(row, column) += 1;
      }
  }
  std::vector<float> sigma_rad;
  for (int row = 0; row < variance.rows; ++row)
    for (int column = 0; column < variance.cols; ++column)
      sigma_rad.push_back(static_cast<float>(std::sqrt(variance(row, column) / presses(row, column))));
  return sigma_rad;
}

}  // namespace gelslam
