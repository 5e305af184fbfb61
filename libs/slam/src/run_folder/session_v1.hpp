#pragma once

#include "gelslam/slam/session.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam::slam::detail {

/// A session of version 1 (up to gelslam 0.2): the map's patches, each as a TIFF of four planes. Throws Error
/// and JSON exceptions.
Session load_session_v1(const std::filesystem::path& folder, const Json& json);

}  // namespace gelslam::slam::detail
