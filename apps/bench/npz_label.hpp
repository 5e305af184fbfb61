#pragma once

#include <filesystem>

#include "ball_fit.hpp"

namespace gelslam::bench {

/// Reads a hand-made contact circle (label.npz: `center` as u, v and `radius`, pixels). Throws Error when
/// damaged.
Circle read_npz_label(const std::filesystem::path& path);

}  // namespace gelslam::bench
