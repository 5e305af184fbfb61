#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace gelslam::bench {

/// Writes a table (an array of objects with the same keys) as folder/name.json and folder/name.csv; the
/// folder is made. Throws Error.
void write_study(const std::filesystem::path& folder, const std::string& name,
                 const nlohmann::ordered_json& rows);

}  // namespace gelslam::bench
