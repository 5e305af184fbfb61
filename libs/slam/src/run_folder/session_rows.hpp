#pragma once

#include <array>
#include <filesystem>
#include <string_view>

#include "gelslam/backend/pose_graph.hpp"
#include "run_folder/database.hpp"

namespace gelslam::slam::detail {

/// Numbers in a row of session.db, as docs/file-formats.md says. There a checksum follows them.
template <std::size_t count>
using Numbers = std::array<double, count>;

inline std::string_view word(EdgeKind kind) { return kind == EdgeKind::loop ? "loop" : "odometry"; }

/// session.db of a run. Throws Error when there is none, or something else is in its place.
std::filesystem::path session_file(const std::filesystem::path& run);

}  // namespace gelslam::slam::detail
