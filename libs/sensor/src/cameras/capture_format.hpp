#pragma once

#include <cstddef>
#include <string>

#include "cameras/video_node.hpp"

namespace gelslam::detail {

/// What the driver agreed to.
struct CaptureFormat {
  std::size_t row_bytes = 0;  ///< with the gap after each row; 0 for JPEG
  double rate_hz = 0;         ///< as asked, where the driver does not say
  std::string warning;        ///< "asked for 25 Hz, the driver gives 15 Hz", or ""
};

/// Sets the format, then the rate (which a new format would reset). Throws Error when the driver quietly
/// chose another format or size, with what was asked, what was granted and what there is.
CaptureFormat negotiate_format(const VideoNode& node, const CameraOptions& options);

}  // namespace gelslam::detail
