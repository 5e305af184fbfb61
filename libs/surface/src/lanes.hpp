#pragma once

namespace gelslam::surface::detail {

/// A vector of eight floats. The compiler maps operations on it to the registers of the instruction set for
/// which it compiles a function (GELSLAM_CLONES).
typedef float Lanes __attribute__((vector_size(32), may_alias));
inline constexpr int kLanes = 8;

}  // namespace gelslam::surface::detail
