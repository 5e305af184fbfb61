#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace gelslam {

/// What was tracked but is not in the mesh: the mesh shows the largest connected component (in the UI:
/// piece).
struct MapCompleteness {
  int pieces_not_joined = 0;            ///< components besides the largest: no loop joins them to it
  std::int64_t frames_not_in_mesh = 0;  ///< tracked frames that are not in the largest component

  bool complete() const { return pieces_not_joined == 0 && frames_not_in_mesh == 0; }
};

/// "1 piece not joined; 16 frames not in the mesh; touch a place between them"; "" when the mesh shows all.
std::string describe(const MapCompleteness& completeness);

/// Of a saved run, from its report.json (also of runs that older versions wrote). Nothing when there is no
/// report, it is damaged, or nothing was saved yet.
std::optional<MapCompleteness> read_completeness(const std::filesystem::path& run_folder);

}  // namespace gelslam
