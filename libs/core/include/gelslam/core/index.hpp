#pragma once

#include <cstddef>

namespace gelslam {

/// An identifier or a signed count as an index into a container. It must not be negative.
constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace gelslam
