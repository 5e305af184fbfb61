#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/core/gradient_model.hpp"

namespace gelslam {

/// Standard deviation of slopes at the best place of the gel, where nothing else is stated.
inline constexpr double kBestSlopeSigmaRad = 0.05;

/// Standard deviation (rad) of the slopes that a color model reads, by place on the gel.
struct SlopeUncertainty {
  cv::Mat1f sigma_rad;  ///< of the cells of a grid over the picture, any size
};

/// What is assumed of a model that does not state its uncertainty (own). Balls are pressed at least their
/// radius away from the border, so that the model extrapolates there: the standard deviation grows toward the
/// border of the picture.
SlopeUncertainty default_uncertainty(cv::Size picture, double pixel_pitch_mm);

/// What the model states, else the default.
SlopeUncertainty uncertainty_of(const GradientModel& model, cv::Size picture, double pixel_pitch_mm);

/// At the best place of the gel, relative to kBestSlopeSigmaRad: Surface::model_sigma.
double relative_sigma(const SlopeUncertainty& uncertainty);

/// 255 (best / sigma)² of every pixel, 1 to 255: Surface::confidence where all is contact. The best is the
/// least sigma, at least kBestSlopeSigmaRad.
cv::Mat1b confidence_map(const SlopeUncertainty& uncertainty, cv::Size picture);

}  // namespace gelslam
