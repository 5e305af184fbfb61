#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/calibration/slope_statistics.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

/// Mean squared error of the angles in each cell, over the pixels of one press; and how many there are.
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

constexpr double kMinPressCellPixels = 32;  // fewer of a press are its outline
// The default counts as this many presses: 0.4 rad at the border would outweigh dozens that were read well.
constexpr double kDefaultCount = 0.02;

}  // namespace

std::vector<float> held_out_sigma_rad(const PressSet& set, const std::vector<BallZone>& zones,
                                      const ModelTraining& training, ProgressSink& progress) {
  ModelTraining half = training;
  half.steps = std::max(1, training.steps / 2);
  cv::Mat1d variance;
  default_uncertainty(set.background.size(), training.pixel_pitch_mm).sigma_rad.convertTo(variance, CV_64F);
  cv::multiply(variance, variance, variance);
  variance *= kDefaultCount;
  cv::Mat1d presses(variance.size(), kDefaultCount);
  std::vector<BallZone> by_ball = zones;  // else balls that alternate would be halves of their own
  std::ranges::stable_sort(by_ball, {},
                           [&](const BallZone& zone) { return set.presses[zone.press].diameter_mm; });
  for (const std::size_t held_out : {0, 1}) {
    std::vector<BallZone> taken;
    for (std::size_t k = 1 - held_out; k < by_ball.size(); k += 2) taken.push_back(by_ball[k]);
    const GradientModel model = train_model(set, taken, half, progress);
    for (std::size_t k = held_out; k < by_ball.size(); k += 2) {
      CellErrors errors;
      for (const ZoneReading& pixel : read_zone(model, set, by_ball[k], training.pixel_pitch_mm))
        errors.add(pixel, set.background.size());
      for (int row = 0; row < variance.rows; ++row)
        for (int column = 0; column < variance.cols; ++column) {
          if (errors.count(row, column) < kMinPressCellPixels) continue;
          variance(row, column) += errors.squares(row, column) / errors.count(row, column);
          presses(row, column) += 1;
        }
    }
  }
  std::vector<float> sigma_rad;
  for (int row = 0; row < variance.rows; ++row)
    for (int column = 0; column < variance.cols; ++column)
      sigma_rad.push_back(static_cast<float>(std::sqrt(variance(row, column) / presses(row, column))));
  return sigma_rad;
}

}  // namespace gelslam
