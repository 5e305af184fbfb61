#pragma once

#include <imgui.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ui/window_theme.hpp"

namespace gelslam::viewer::detail {

/// Part of the window, framebuffer pixels, y down.
struct Box {
  float x = 0, y = 0, width = 0, height = 0;
  float right() const { return x + width; }
  float bottom() const { return y + height; }
  ImVec2 top_left() const { return {x, y}; }
  ImVec2 bottom_right() const { return {right(), bottom()}; }
  bool contains(double px, double py) const { return px >= x && px < right() && py >= y && py < bottom(); }
  Box inset(float margin) const { return {x + margin, y + margin, width - 2 * margin, height - 2 * margin}; }
};

/// Where a text that is too long loses letters.
enum class Cut { start, end };

/// What was written where: by it a script finds a button, and a test its words.
struct DrawnText {
  std::string text;
  Box box;
  ImU32 color = 0;
};

/// Draws the window's flat parts through ImGui's draw list, and remembers what it wrote and which places
/// belong to panels, not to the view behind them. Lives for one frame, between the host's begin_frame() and
/// end_frame().
class Canvas {
 public:
  explicit Canvas(float scale);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  float px(double design_px) const { return static_cast<float>(design_px) * scale_; }
  const WindowFonts& fonts() const { return fonts_; }

  void fill(const Box& box, ImU32 color, double rounding = 0);
  void frame(const Box& box, ImU32 color, double rounding = 0, double thickness = 1);
  /// A filled box that takes the mouse from what lies behind.
  void panel(const Box& box, ImU32 color, double rounding = 10);
  void disc(float x, float y, float radius, ImU32 color);
  /// A circle's line; `clip` keeps it inside a box.
  void ring(float x, float y, float radius, ImU32 color, double thickness, const Box& clip);
  void image(unsigned texture, const Box& box, double rounding = 6);

  float width_of(ImFont* font, std::string_view text) const;
  float height_of(ImFont* font, std::string_view text, float wrap_width) const;
  void text(ImFont* font, float x, float y, ImU32 color, std::string_view text);
  void text_right(ImFont* font, float right, float y, ImU32 color, std::string_view text);
  void text_centered(ImFont* font, const Box& box, ImU32 color, std::string_view text);
  /// Broken into lines; returns the height.
  float text_wrapped(ImFont* font, float x, float y, float wrap_width, ImU32 color, std::string_view text);
  /// Shortened until it fits, at its start ("…/run/mesh.ply", of a path the end says most) or at its end.
  std::string fitted(ImFont* font, std::string_view text, float width, Cut cut = Cut::start) const;

  /// Clicked in this frame. `face` and `ink` are its colors when the mouse is elsewhere.
  bool button(const Box& box, std::string_view label, std::string_view hint, ImU32 face, ImU32 ink);

  /// From here on all lies over what was drawn before, and nothing below can be clicked.
  void cover(ImU32 color);

  std::vector<DrawnText> take_texts() { return std::move(texts_); }
  std::vector<Box> take_panels() { return std::move(panels_); }

 private:
  void record(const Box& box, ImU32 color, std::string_view text);

  float scale_;
  WindowFonts fonts_;
  ImDrawList* list_ = nullptr;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
};

}  // namespace gelslam::viewer::detail
