#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam::surface::detail {

/// Largest pickle that is read; real ones have 1 KiB.
inline constexpr std::size_t kMaxPickleBytes = 64 * 1024;

/// One tensor named by a pickled state_dict: where its numbers lie, not the numbers themselves.
struct TensorEntry {
  std::string name;                   ///< "fc1.weight"
  std::string storage_class;          ///< "FloatStorage": of float32
  std::string storage_key;            ///< the zip entry <root>/data/<storage_key>
  std::int64_t storage_elements = 0;  ///< length of that storage in numbers
  std::int64_t storage_offset = 0;    ///< in numbers
  std::vector<std::int64_t> shape;
  std::vector<std::int64_t> stride;  ///< in numbers, as long as shape
};

/// Reads the named tensors in the `data.pkl` of a PyTorch state_dict, or of a checkpoint's dictionary with an
/// entry `state_dict` or `model_state_dict` (pickle protocols 2 to 5), laid out as torch.save does. Runs no
/// code: it knows the opcodes and globals such a file needs and throws Error on anything else, naming it. At
/// most kMaxPickleBytes.
std::vector<TensorEntry> read_state_dict_pickle(std::string_view pickle);

}  // namespace gelslam::surface::detail
