#pragma once

#include <string>

namespace gelslam::detail {

/// The shortest text that reads back as the same double: "0.3".
std::string format_number(double value);

}  // namespace gelslam::detail
