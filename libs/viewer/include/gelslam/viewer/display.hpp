#pragma once

namespace gelslam {

/// True when the environment names a display that a window could open on.
bool has_display();

}  // namespace gelslam
