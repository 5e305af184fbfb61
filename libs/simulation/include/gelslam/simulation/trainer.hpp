#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam {

/// The pixel-wise network of the public systems, 5-32-32-32-2 with ReLU: (B, G, R)/255, u/W, v/H -> slope
/// angles (atan dh/dx, atan dh/dy) in radians. Weights row-major [out][in].
struct SimulatedNetwork {
  static constexpr std::array<int, 5> sizes = {5, 32, 32, 32, 2};
  std::array<std::vector<float>, 4> weight, bias;
};

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
SimulatedNetwork train_network(const TrainingSamples& samples, const TrainingOptions& options);

/// Slopes (dh/dx, dh/dy) that the network reads in a picture; nothing is subtracted.
cv::Mat2f read_slopes(const SimulatedNetwork& network, const cv::Mat3b& bgr);

/// Writes a PyTorch state_dict (zip with pickle protocol 2) that torch.load reads. Same network, same bytes.
void write_pth(const std::filesystem::path& path, const SimulatedNetwork& network);

}  // namespace gelslam
