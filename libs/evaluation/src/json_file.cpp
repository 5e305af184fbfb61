#include "json_file.hpp"

#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam::evaluation::detail {
namespace {

constexpr std::uintmax_t kMaxBytes = 64U << 20;

}  // namespace

nlohmann::json read_json_object(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw Error("cannot read " + path.string() + ": " + error.message());
  if (bytes > kMaxBytes) throw Error(path.string() + " is too large for what it should hold (over 64 MB)");
  nlohmann::json object = nlohmann::json::parse(read_file(path), nullptr, false);
  if (!object.is_object()) throw Error(path.string() + " does not hold a JSON object: is it cut off?");
  return object;
}

std::optional<double> number_at(const nlohmann::json& object, const std::string& key, double low, double high,
                                const std::filesystem::path& path) {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return std::nullopt;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!(value >= low && value <= high)) {
    throw Error(path.string() + ": " + key + " is not a number from " + nlohmann::json(low).dump() + " to " +
                nlohmann::json(high).dump());
  }
  return value;
}

std::optional<int> integer_at(const nlohmann::json& object, const std::string& key, int low,
                              const std::filesystem::path& path) {
  const auto value = number_at(object, key, low, std::numeric_limits<int>::max(), path);
  if (!value) return std::nullopt;
  if (*value != std::floor(*value)) throw Error(path.string() + ": " + key + " is not a whole number");
  return static_cast<int>(*value);
}

}  // namespace gelslam::evaluation::detail
