#include "study_files.hpp"

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::bench {
namespace {

using Json = nlohmann::ordered_json;

std::string to_csv(const Json& rows) {
  std::string text;
  if (rows.empty()) return text;
  for (const auto& [key, value] : rows.front().items()) text += (text.empty() ? "" : ",") + key;
  for (const Json& row : rows) {
    text += "\n";
    bool first = true;
    for (const auto& [key, value] : row.items()) {
      text += (first ? "" : ",") + (value.is_string() ? '"' + value.get<std::string>() + '"' : value.dump());
      first = false;
    }
  }
  return text + "\n";
}

}  // namespace

void write_study(const std::filesystem::path& folder, const std::string& name, const Json& rows) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw Error("cannot make folder " + folder.string() + ": " + failure.message());
  write_file_atomically(folder / (name + ".json"), rows.dump(1) + "\n");
  write_file_atomically(folder / (name + ".csv"), to_csv(rows));
}

}  // namespace gelslam::bench
