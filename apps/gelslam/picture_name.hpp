#pragma once

#include <string>

namespace gelslam {

/// A check for options that name a picture to write: "" or why not. An ending that promises something else is refused.
std::string refuse_unless_png(const std::string& path);

}  // namespace gelslam
