#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// Returns "120 frames in the map; 1 trial in 1 piece, 6 keyframes, 1 loop".
std::string map_words(const RunReport& report);
/// "mesh of 12146 vertices and 23394 triangles".
std::string mesh_words(const RunReport::MeshSize& mesh);
/// Returns "3.2 cm² touched, 90 % of it in the mesh; 10 % not joined" and a line break; or "".
std::string touched_line(const RunReport::Touched& touched);

/// Returns what `reconstruct` and `fuse` print at the end, with a line for each part of the scan; in quiet
/// mode only warnings.
std::string run_words(const RunReport& report, const std::string& run_folder, bool quiet);

/// Returns a line "warning: 1 piece not joined; ..." for each warning.
std::string warning_words(const std::vector<std::string>& warnings);

/// Prints the warnings of a run on stderr.
void print_run_warnings(const std::filesystem::path& run_folder);

/// Prints a line "warning: ..." on stderr; nothing for "".
void warn(const std::string& warning);

}  // namespace gelslam
