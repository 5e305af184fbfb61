#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace gelslam {

/// A float32 tensor on its way into a file; `values` are row-major, as many as `shape` says.
struct NamedTensor {
  std::string name;
  std::vector<int> shape;
  std::span<const float> values;
};

/// Writes a PyTorch (>= 1.6) state_dict: a zip with pickle protocol 2 that torch.load reads, also with
/// weights_only. The same tensors give the same bytes. Throws Error when the disk does not take it.
void write_state_dict(const std::filesystem::path& path, const std::vector<NamedTensor>& tensors);

}  // namespace gelslam
