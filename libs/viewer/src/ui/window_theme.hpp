#pragma once

#include <imgui.h>

#include "live/status_text.hpp"

namespace gelslam::viewer::detail {

/// Letters of one face in the sizes the window uses; loaded by load_fonts().
struct WindowFonts {
  ImFont* small = nullptr;     ///< labels
  ImFont* body = nullptr;      ///< sentences, buttons
  ImFont* title = nullptr;     ///< what to do
  ImFont* figure = nullptr;    ///< numbers
  ImFont* headline = nullptr;  ///< the state, to be read from across the room
};

namespace theme {
inline constexpr ImU32 backdrop = IM_COL32(12, 14, 17, 255);  ///< where there is no view behind the panels
inline constexpr ImU32 text = IM_COL32(233, 237, 241, 255);
inline constexpr ImU32 dim = IM_COL32(150, 161, 173, 255);
inline constexpr ImU32 panel = IM_COL32(22, 26, 31, 235);
inline constexpr ImU32 raised = IM_COL32(40, 46, 54, 255);
inline constexpr ImU32 hovered = IM_COL32(56, 64, 75, 255);
inline constexpr ImU32 line = IM_COL32(48, 55, 64, 255);
inline constexpr ImU32 green = IM_COL32(82, 211, 146, 255);
inline constexpr ImU32 amber = IM_COL32(245, 184, 75, 255);
inline constexpr ImU32 red = IM_COL32(248, 103, 92, 255);
inline constexpr ImU32 blue = IM_COL32(104, 176, 250, 255);
inline constexpr ImU32 gray = IM_COL32(176, 186, 197, 255);
ImU32 of_state(LiveState state);
ImU32 with_alpha(ImU32 color, double alpha);  ///< alpha in [0, 1]
}  // namespace theme

void apply_theme(ImGuiStyle& style);

/// Makes the fonts of the current ImGui context for a scale, if they are not there yet: true when they are
/// new, and their texture is to be sent. A face from the system where one of the usual ones is installed,
/// else ImGui's own.
bool load_fonts(float scale);
/// Of the current context, after load_fonts().
WindowFonts window_fonts();

}  // namespace gelslam::viewer::detail
