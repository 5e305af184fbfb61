#pragma once

#include <span>
#include <string>

#include "gelslam/surface/gradient_model.hpp"

namespace gelslam::surface::detail {

/// read_pth_model on bytes already in memory; `name` appears in messages. Throws Error, nothing else,
/// whatever the bytes.
GradientModel parse_pth_model(std::span<const unsigned char> file, const std::string& name);

}  // namespace gelslam::surface::detail
