#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam {

enum class NpyType { float16, float32, float64, int64, uint8, boolean };

/// An array of a .npy file, C order (last index fastest). `data` holds the elements as little-endian bytes.
struct NpyArray {
  NpyType type = NpyType::float64;
  std::vector<std::size_t> shape;  ///< empty for a scalar
  std::vector<std::byte> data;

  std::size_t size() const;  ///< number of elements
  /// All elements converted to double (booleans to 0 and 1).
  std::vector<double> to_doubles() const;
};

/// Reads versions 1 to 3 of the format (numpy.lib.format). Throws Error when the file is missing, truncated,
/// longer than its header says, larger than `max_bytes`, in Fortran order, big-endian or of another type.
/// Never runs code (pickled objects are refused).
NpyArray read_npy(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 31);

/// Reads an array from memory; `name` stands for the file in errors.
NpyArray parse_npy(std::string_view bytes, const std::string& name);

/// Returns the bytes of a file of float64 values, version 1.0, as write_npy() writes them.
std::string format_npy(const std::vector<std::size_t>& shape, std::span<const double> values);

/// Writes version 1.0, atomically. `values` must have as many elements as `shape` says (else
/// std::invalid_argument).
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const double> values);
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape,
               std::span<const float> values);

}  // namespace gelslam
