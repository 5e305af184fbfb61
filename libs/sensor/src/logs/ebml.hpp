#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace gelslam::detail {

// EBML (RFC 8794), the syntax of Matroska: an element is its id, its length and its payload. Ids are given
// with their length marker, as the specifications print them.

/// Id and length of an element whose payload follows elsewhere.
std::string ebml_head(std::uint32_t id, std::uint64_t payload_bytes);
std::string ebml_element(std::uint32_t id, std::string_view payload);
std::string ebml_number(std::uint32_t id, std::uint64_t value);
std::string ebml_real(std::uint32_t id, double value);
/// A master element of unknown length, and that length once it is known: eight bytes either way.
std::string ebml_unknown_length();
std::string ebml_length_8(std::uint64_t payload_bytes);
/// An element without meaning that keeps `total_bytes` (2 to 128) free.
std::string ebml_void(std::size_t total_bytes);
/// `value` as eight bytes, most significant first.
std::string big_endian_8(std::uint64_t value);

}  // namespace gelslam::detail
