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

/// The contents of an `nnmodel.pth`, as Python writes it (write_pth.py). Members can be changed to make it
/// invalid.
struct PthFile {
  std::vector<PthLayer> layers;
  std::vector<PthNorm> norms;  ///< follow the first layers
  std::string layer_name = "fc", prefix;
  int protocol = 2;  ///< of the pickle format
  std::string storage_class = "torch FloatStorage";
  std::string rebuild_function = "torch._utils _rebuild_tensor_v2";
  std::map<std::string, std::string> more_entries = {{"byteorder", "little"}, {"version", "3\n"}};
  std::string root = "nnmodel";
  int storage_offset = 0;            ///< the offset of every tensor, in numbers
  bool checkpoint = false;           ///< the state_dict as an entry beside `epoch` and `optimizer`
  std::string entry = "state_dict";  ///< of a checkpoint
  bool with_metadata = true;         ///< the attribute torch sets on a state_dict
  bool gives_normals = false;        ///< outputs parts of a unit normal, and takes v/H before u/W

  std::map<std::string, std::string> entries() const;  ///< names and contents
};

/// Returns the slope angles of the network for these inputs, by its definition in double precision.
std::vector<double> naive_angles(const PthFile& file, std::vector<double> inputs);

/// Returns the bytes of a zip archive with these entries, stored or compressed.
std::string zip_archive(const std::map<std::string, std::string>& entries);

/// Returns a 5-32-32-32-2 network (or one of other sizes) with random numbers, uniform in +-0.3.
std::vector<PthLayer> random_layers(std::uint64_t seed, const std::vector<int>& sizes = {5, 32, 32, 32, 2});
/// Returns random batch normalizations for all layers except the last.
std::vector<PthNorm> random_norms(std::uint64_t seed, const std::vector<PthLayer>& layers);
GradientModel random_model(std::uint64_t seed);
/// Returns a checkpoint like that of GelSight with random numbers, so small that the outputs are parts of
/// unit normals.
PthFile makers_file(std::uint64_t seed);
std::vector<PthLayer> layers_of(const GradientModel& model);

}  // namespace gelslam::test
