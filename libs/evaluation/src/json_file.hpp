#pragma once

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace gelslam::evaluation::detail {

/// Parses a file that holds one JSON object (at most 64 MB). Throws Error, naming the file, when it does not.
nlohmann::json read_json_object(const std::filesystem::path& path);

/// The number at `key`, none where the key is absent. Throws Error when it is no finite number from `low` to
/// `high`.
std::optional<double> number_at(const nlohmann::json& object, const std::string& key, double low, double high,
                                const std::filesystem::path& path);

/// The same for a whole number from `low` to the largest int.
std::optional<int> integer_at(const nlohmann::json& object, const std::string& key, int low,
                              const std::filesystem::path& path);

}  // namespace gelslam::evaluation::detail
