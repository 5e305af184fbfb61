#include "gelslam/slam/map_completeness.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "gelslam/core/text.hpp"

namespace gelslam {

std::string describe(const MapCompleteness& completeness) {
  std::string text;
  if (completeness.pieces_not_joined > 0)
    text = counted(completeness.pieces_not_joined, "piece") + " not joined";
  if (completeness.frames_not_in_mesh > 0)
    append_sentence(text, counted(completeness.frames_not_in_mesh, "frame") + " not in the mesh");
  if (completeness.pieces_not_joined > 0) append_sentence(text, "touch a place between them");
  return text;
}

std::optional<MapCompleteness> read_completeness(const std::filesystem::path& run_folder) {
  std::ifstream stream(run_folder / "report.json");
  const nlohmann::json report = nlohmann::json::parse(stream, nullptr, /*allow_exceptions=*/false);
  try {
    const nlohmann::json& frames = report.at("frames");
    const auto components = report.at(report.contains("components") ? "components" : "groups").get<int>();
    const auto not_in_mesh =
        frames.at("tracked").get<std::int64_t>() - frames.at("in_map").get<std::int64_t>();
    return MapCompleteness{std::max(components - 1, 0), std::max<std::int64_t>(not_in_mesh, 0)};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace gelslam
