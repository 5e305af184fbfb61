#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_kernels.hpp"

namespace gelslam {

struct NormalFlowReference::Impl {
  SurfacePtr surface;
  registration::detail::Samples samples;
  std::vector<float> curvature;  ///< per sample, for SCR and CCS
};

namespace registration::detail {

/// Of sample k's normal, by the five parameters.
inline Eigen::Matrix<float, 3, kParameters> jacobian_of(const Samples& samples, std::size_t k) {
  Eigen::Matrix<float, 3, kParameters> jacobian;
  for (int c = 0; c < 3; ++c)
    for (int a = 0; a < kParameters; ++a)
      jacobian(c, a) = samples.jacobian[static_cast<std::size_t>(c * kParameters + a)][k];
  return jacobian;
}

}  // namespace registration::detail

}  // namespace gelslam
