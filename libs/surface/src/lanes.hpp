#pragma once

namespace gelslam::surface::detail {

/// Eight floats at once; the compiler splits or joins them for the instruction set (GELSLAM_CLONES).
typedef float Lanes __attribute__((vector_size(32), may_alias));
inline constexpr int kLanes = 8;

}  // namespace gelslam::surface::detail
