#pragma once

#include "gelslam/fusion/fusion.hpp"

namespace gelslam::fusion::detail {

/// Throws Error for options that make no sense.
void check_options(const FusionOptions& options);

}  // namespace gelslam::fusion::detail
