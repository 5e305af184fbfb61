#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "gelslam/surface/gradient_model.hpp"

namespace gelslam::test {

/// One layer of any size; weights are row-major [out][in].
struct PthLayer {
  int inputs = 0, outputs = 0;
  std::vector<float> weight, bias;
};

/// A batch normalization.
struct PthNorm {
  std::vector<float> weight, bias, running_mean, running_var;
};

/// What an `nnmodel.pth` is made of, written by Python (write_pth.py), with places to make it wrong.
struct PthFile {
  std::vector<PthLayer> layers;
  std::vector<PthNorm> norms;  ///< behind the first layers
  std::string layer_name = "fc", prefix;
  int protocol = 2;  ///< of pickle
  std::string storage_class = "torch FloatStorage";
  std::string rebuild_function = "torch._utils _rebuild_tensor_v2";
  std::map<std::string, std::string> more_entries = {{"byteorder", "little"}, {"version", "3\n"}};
  std::string root = "nnmodel";
  int storage_offset = 0;            ///< of every tensor, in numbers
  bool checkpoint = false;           ///< the state_dict as an entry beside `epoch` and `optimizer`
  std::string entry = "state_dict";  ///< of a checkpoint
  bool with_metadata = true;         ///< the attribute torch sets on a state_dict
  bool gives_normals = false;        ///< two parts of a unit normal, and takes v/H before u/W

  std::map<std::string, std::string> entries() const;  ///< names and contents
};

/// The slope angles that the network means for these inputs, by its definition in double precision.
std::vector<double> naive_angles(const PthFile& file, std::vector<double> inputs);

/// Entries, stored or compressed, as the bytes of a zip archive.
std::string zip_archive(const std::map<std::string, std::string>& entries);

/// A 5-32-32-32-2 network (or other sizes) with numbers from a seed, uniform in +-0.3.
std::vector<PthLayer> random_layers(std::uint64_t seed, const std::vector<int>& sizes = {5, 32, 32, 32, 2});
/// For all layers but the last.
std::vector<PthNorm> random_norms(std::uint64_t seed, const std::vector<PthLayer>& layers);
GradientModel random_model(std::uint64_t seed);
/// The maker's checkpoint with such numbers, small enough that its outputs are parts of unit normals.
PthFile makers_file(std::uint64_t seed);
std::vector<PthLayer> layers_of(const GradientModel& model);

}  // namespace gelslam::test
