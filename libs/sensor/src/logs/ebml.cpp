#include "logs/ebml.hpp"

#include <bit>
#include <cassert>

namespace gelslam::detail {
namespace {

std::string last_bytes(std::uint64_t value, int count) {
  std::string bytes;
  for (int shift = 8 * (count - 1); shift >= 0; shift -= 8)
    bytes += static_cast<char>((value >> shift) & 0xff);
  return bytes;
}

/// A length takes seven bits of each of its bytes; all ones mean "unknown".
std::string shortest_length(std::uint64_t length) {
  int count = 1;
  while (length >= (std::uint64_t{1} << (7 * count)) - 1) ++count;
  return last_bytes(length | (std::uint64_t{1} << (7 * count)), count);
}

}  // namespace

std::string ebml_head(std::uint32_t id, std::uint64_t payload_bytes) {
  const int id_bytes = (std::bit_width(id) + 7) / 8;
  return last_bytes(id, id_bytes) + shortest_length(payload_bytes);
}

std::string ebml_element(std::uint32_t id, std::string_view payload) {
  std::string element = ebml_head(id, payload.size());
  element += payload;
  return element;
}

std::string ebml_number(std::uint32_t id, std::uint64_t value) {
  return ebml_element(id, big_endian_8(value));
}

std::string ebml_real(std::uint32_t id, double value) {
  return ebml_element(id, big_endian_8(std::bit_cast<std::uint64_t>(value)));
}

std::string ebml_unknown_length() { return last_bytes(0x01ffffffffffffff, 8); }
std::string ebml_length_8(std::uint64_t payload_bytes) {
  return last_bytes(payload_bytes | (std::uint64_t{1} << 56), 8);
}

std::string ebml_void(std::size_t total_bytes) {
  constexpr std::uint32_t void_id = 0xec;
  assert(total_bytes >= 2 && total_bytes <= 128);
  return ebml_element(void_id, std::string(total_bytes - 2, '\0'));
}

std::string big_endian_8(std::uint64_t value) { return last_bytes(value, 8); }

}  // namespace gelslam::detail
