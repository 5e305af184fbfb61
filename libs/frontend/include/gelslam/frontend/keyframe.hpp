#pragma once

#include <cstdint>
#include <memory>

#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// A frame that later frames are registered to.
struct Keyframe {
  int id = 0;              ///< counts keyframes of the whole log from 0, across trials
  std::int64_t frame = 0;  ///< index in the log
  int trial = 0;
  SurfacePtr surface;
  std::shared_ptr<const NormalFlowReference> reference;  ///< prepared once, shared with loop closure
};

}  // namespace gelslam
