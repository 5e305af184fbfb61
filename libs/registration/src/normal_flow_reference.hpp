#pragma once

#include <vector>

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_kernels.hpp"

namespace gelslam {

struct NormalFlowReference::Impl {
  SurfacePtr surface;
  registration::detail::Samples samples;
  std::vector<float> curvature;  ///< per sample, for SCR and CCS
};

}  // namespace gelslam
