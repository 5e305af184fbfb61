#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gelslam/slam/config.hpp"

namespace gelslam::lab {

/// The chain with some keys of its configuration set, mostly so that a mechanism is off.
struct Variant {
  std::string name;
  std::vector<std::pair<std::string, std::string>> settings;  ///< key, value
};

/// One for every mechanism that an option switches off.
std::vector<Variant> mechanism_variants();

/// Reads "name: key=value, key=value". Throws Error.
Variant parse_variant(const std::string& text);

/// A key that occurs in several sections is written section.key. Throws Error on an unknown or ambiguous key
/// and on a value that the configuration refuses.
Config with_settings(const Config& config, const Variant& variant);

}  // namespace gelslam::lab
