#pragma once

#include <filesystem>
#include <memory>

#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam::detail {

/// A Matroska log of ours as a stream of pictures, decoded as a live frame is (FrameDecoder). Damaged
/// pictures are left out and counted in warning(). Null when its pictures are of a kind that RawFrame does
/// not know.
std::unique_ptr<FrameSource> open_matroska_frames(const std::filesystem::path& log,
                                                  const SensorProfile& profile);

/// The same log as raw frames, or null.
std::unique_ptr<RawFrameSource> open_matroska_log(const std::filesystem::path& log,
                                                  const SensorProfile& profile);

}  // namespace gelslam::detail
