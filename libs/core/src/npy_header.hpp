#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam::detail {

/// What the dictionary at the start of a .npy file says.
struct NpyHeader {
  std::string descr;
  bool fortran_order = false;
  std::vector<std::size_t> shape;
};

/// Parses "{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }", keys in any order, each exactly
/// once. Anything else throws std::invalid_argument saying what was expected.
NpyHeader parse_npy_header(std::string_view text);

/// The same dictionary as numpy writes it.
std::string format_npy_header(const NpyHeader& header);

}  // namespace gelslam::detail
