#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam::surface::detail {

/// The largest pickle file that is read. Real ones have 1 KiB.
inline constexpr std::size_t kMaxPickleBytes = 64 * 1024;

/// A tensor of a pickled state_dict: its name, its shape, and where its numbers are in the archive.
struct TensorEntry {
  std::string name;                   ///< for example "fc1.weight"
  std::string storage_class;          ///< for example "FloatStorage", which holds float32
  std::string storage_key;            ///< the numbers are in the zip entry <root>/data/<storage_key>
  std::int64_t storage_elements = 0;  ///< length of that storage in numbers
  std::int64_t storage_offset = 0;    ///< in numbers
  std::vector<std::int64_t> shape;
  std::vector<std::int64_t> stride;  ///< in numbers, as long as shape
};

/// Reads the named tensors in the `data.pkl` of a PyTorch state_dict, or of a checkpoint's dictionary with an
/// entry `state_dict` or `model_state_dict`, as torch.save writes it with the pickle protocols 2 to 5. No
/// code is executed: only the opcodes and globals that such a file needs are known. Throws Error for any
/// other, and for more than kMaxPickleBytes.
std::vector<TensorEntry> read_state_dict_pickle(std::string_view pickle);

}  // namespace gelslam::surface::detail
