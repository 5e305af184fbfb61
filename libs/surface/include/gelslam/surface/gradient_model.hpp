#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace gelslam {

/// The pixel-wise network of the public systems: (B,G,R)/255, u/W, v/H -> two slope angles in radians.
/// 5-32-32-32-2, ReLU. Weights are row-major [out][in].
struct GradientModel {
  struct Layer {
    int inputs = 0, outputs = 0;
    std::vector<float> weight;  ///< outputs x inputs, row-major
    std::vector<float> bias;    ///< outputs
  };
  std::vector<Layer> layers;  ///< four
};

/// Reads a PyTorch state_dict (`nnmodel.pth`: zip + pickle protocol 2) without ever running code: only the
/// opcodes and globals a state_dict of float32 tensors needs are known, all else is refused. Throws Error.
GradientModel read_pth_model(const std::filesystem::path& path);

/// Writes a state_dict that torch.load and read_pth_model read. Throws Error when the disk does not take it.
void write_pth_model(const std::filesystem::path& path, const GradientModel& model);

/// The same from bytes in memory; `name` appears in messages. Throws Error, nothing else, whatever the bytes.
GradientModel parse_pth_model(std::span<const unsigned char> file, const std::string& name);

}  // namespace gelslam
