#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/core/progress.hpp"

namespace gelslam {

/// Samples one after another: 5 features and 2 angles each.
struct TrainingSamples {
  std::vector<float> features, angles_rad;
  std::size_t size() const { return angles_rad.size() / 2; }
  void add(const cv::Mat3b& bgr, int u, int v, float angle_x_rad, float angle_y_rad);
};

struct TrainingOptions {
  int epochs = 60;
  int batch = 1024;
  double learning_rate = 2e-3;
  int halve_every_epochs = 8;
  std::uint64_t seed = 1;  ///< of first weights and of the order of samples
};

/// L1 loss, Adam (Kingma & Ba 2015); one thread, deterministic on one kind of processor. Throws Error for
/// options out of range or fewer samples than one batch.
GradientModel train_network(const TrainingSamples& samples, const TrainingOptions& options,
                            ProgressSink& progress);

/// Slopes (dh/dx, dh/dy) that the network reads in a picture; nothing is subtracted.
cv::Mat2f read_slopes(const GradientModel& network, const cv::Mat3b& bgr);

}  // namespace gelslam
