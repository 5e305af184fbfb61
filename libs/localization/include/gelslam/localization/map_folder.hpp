#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/fusion/fusion.hpp"

namespace gelslam {

/// The surfaces of a map, at their places in its frame: of a run folder, of the session in it, or of a folder
/// that `gelslam map` made. Throws Error when there is none, or it is damaged.
std::vector<PosedSurface> read_map(const std::filesystem::path& folder);

}  // namespace gelslam
