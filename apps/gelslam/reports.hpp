#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

/// "120 frames in the map; 1 trial in 1 piece, 6 keyframes, 1 loop".
std::string map_words(const RunReport& report);
/// "mesh of 12146 vertices and 23394 triangles".
std::string mesh_words(const RunReport::MeshSize& mesh);
/// "3.2 cm² touched, 90 % of it in the mesh; 10 % not joined" and a line break; or "".
std::string touched_line(const RunReport::Touched& touched);

/// What `reconstruct` and `fuse` say at the end, with a line for each part of the scan; when quiet only
/// warnings.
std::string run_words(const RunReport& report, const std::string& run_folder, bool quiet);

/// A line "warning: 1 piece not joined; ..." for each.
std::string warning_words(const std::vector<std::string>& warnings);

/// On stderr, those of a run.
void print_run_warnings(const std::filesystem::path& run_folder);

/// A line "warning: ..." on stderr; nothing for "".
void warn(const std::string& warning);

}  // namespace gelslam
