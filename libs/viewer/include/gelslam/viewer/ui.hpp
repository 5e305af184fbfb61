#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam::viewer {

using Color = std::uint32_t;  ///< red in the lowest byte, then green, blue, alpha

namespace theme {
constexpr Color rgb(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t a = 255) {
  return r | g << 8U | b << 16U | a << 24U;
}
Color with_alpha(Color color, double alpha);  ///< alpha in [0, 1]
inline constexpr Color kBackdrop = rgb(12, 14, 17);
inline constexpr Color kText = rgb(233, 237, 241);
inline constexpr Color kDim = rgb(150, 161, 173);
inline constexpr Color kPanel = rgb(22, 26, 31, 235);
inline constexpr Color kRaised = rgb(40, 46, 54);
inline constexpr Color kHovered = rgb(56, 64, 75);
inline constexpr Color kLine = rgb(48, 55, 64);
inline constexpr Color kGreen = rgb(82, 211, 146);
inline constexpr Color kAmber = rgb(245, 184, 75);
inline constexpr Color kRed = rgb(248, 103, 92);
inline constexpr Color kBlue = rgb(104, 176, 250);
inline constexpr Color kGray = rgb(176, 186, 197);
}  // namespace theme

/// Part of the window, in framebuffer pixels, y down.
struct Box {
  float x = 0, y = 0, width = 0, height = 0;
  float right() const { return x + width; }
  float bottom() const { return y + height; }
  bool contains(double px, double py) const { return px >= x && px < right() && py >= y && py < bottom(); }
  Box inset(float margin) const { return {x + margin, y + margin, width - 2 * margin, height - 2 * margin}; }
  /// Returns the largest box with this aspect (height over width) in its middle.
  Box largest(float aspect) const;
  // The following functions cut a part off and return it.
  Box cut_top(float part);
  Box cut_bottom(float part);
  Box cut_right(float part);
};

/// Text sizes: labels; sentences and buttons; advice; numbers (bold); the state, to be read from a distance.
enum class Face { small, body, title, figure, headline };

/// Where a text that is too long is shortened; `none`: a table column becomes as wide as the text.
enum class Cut { start, middle, end, none };

/// Inserts line breaks at blanks, but not between a number and its unit (width 0: no line breaks).
std::string wrapped(Face face, std::string_view text, float width);

struct Paragraph {
  Face face;
  Color color;
  std::string text;
};

/// A text that was drawn, with its position; tests find texts and buttons by it.
struct DrawnText {
  std::string text;
  Box box;
  Color color = 0;
};

/// An image that the window can draw. The context in which it was created must be current.
class Texture {
 public:
  Texture() = default;
  ~Texture();
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  void set(const cv::Mat3b& bgr);
  bool empty() const { return size_.area() == 0; }
  unsigned id() const { return id_; }
  float aspect() const {  ///< height over width
    return empty() ? 0 : static_cast<float>(size_.height) / static_cast<float>(size_.width);
  }

 private:
  unsigned id_ = 0;
  cv::Size size_;
};

/// The two-dimensional parts of a window in one frame of Dear ImGui: marks over the view, panels with text,
/// tables and buttons, and one dialog above everything. It exists between begin_frame() and end_frame() of
/// WindowHost. It records which texts were drawn, and which boxes belong to panels and not to the view.
class Ui {
 public:
  static constexpr double kDialogPadding = 26;  ///< design pixels

  explicit Ui(float scale);
  ~Ui();
  Ui(const Ui&) = delete;
  Ui& operator=(const Ui&) = delete;

  float px(double design_px) const { return static_cast<float>(design_px) * scale_; }
  Box window() const;

  // Shapes and text at given positions. Within a panel they belong to it, otherwise they are drawn over the
  // view.
  void fill(const Box& box, Color color, double rounding = 0);
  void frame(const Box& box, Color color, double rounding = 0, double thickness = 1);
  void disc(float x, float y, float radius, Color color);
  void ring(float x, float y, float radius, Color color, double thickness, const Box& clip);
  void line(float x0, float y0, float x1, float y1, Color color, double thickness, const Box& clip);
  void image(const Texture& texture, const Box& box, double rounding = 6);
  float width_of(Face face, std::string_view text) const;
  float height_of(Face face) const;
  float height_of(Face face, std::string_view text, float wrap_width) const;
  /// Shortens a text until it fits. Paths are shortened at the start, "…/run/mesh.ply", as their end is the
  /// most important part.
  std::string fitted(Face face, std::string_view text, float width, Cut cut) const;
  void text_at(Face face, float x, float y, Color color, std::string_view text, float wrap_width = 0);
  void text_right(Face face, float right, float y, Color color, std::string_view text);
  void text_centered(Face face, const Box& box, Color color, std::string_view text);
  /// Draws a word with a background; `anchor` as in card().
  void tag(Face face, float x, float y, Color ink, Color ground, std::string_view text, float anchor_x = 0.5F,
           float anchor_y = 0.5F);
  /// Draws a box with paragraphs, at most `most_width` wide, with a colored left edge if `edge` is not 0.
  /// `anchor` is the fraction of its size that is left of and above the position.
  Box card(float x, float y, float most_width, Color edge, const std::vector<Paragraph>& paragraphs,
           float anchor_x = 0, float anchor_y = 0, double least_width = 0);

  // Panels, whose content runs from the top down. Without a given height they are as high as their content.
  // `anchor` is the fraction of their size that is left of and above the box's corner.
  void begin_panel(const char* id, const Box& box, double padding = 0, double rounding = 0,
                   float anchor_x = 0, float anchor_y = 0);
  void end_panel();
  /// Begins a part of a panel that scrolls if it is too high. With height 0 it extends to the panel's lower
  /// edge.
  void begin_child(const char* id, float height = 0);
  void end_child();
  Box room() const;  ///< Returns the box from the next item to the panel's lower right corner.
  void gap(double design_px);
  void text(Face face, Color color, std::string_view text, Cut cut = Cut::end);
  void paragraph(Face face, Color color, std::string_view text);
  /// Draws a name at the left (dim) and its value at the right.
  void row(Face face, std::string_view name, std::string_view value, Color value_color = theme::kText,
           Cut cut = Cut::end);
  void bar(double share, Color color, double height);  ///< Draws a bar that is filled to `share`.
  /// Begins a table with columns of equal width, or as wide as their content.
  bool begin_table(const char* id, int columns, double column_gap = 0, bool by_content = false);
  void next_cell();
  void end_table();
  /// Indents the following content of the panel; a negative value reverses it.
  void indent(double design_px);
  /// Returns the horizontal position within the box, as a fraction of its width, while the left button is
  /// held there. The box itself is invisible.
  std::optional<double> held_share(const char* id, const Box& box);

  /// Begins the dialog above everything; nothing below it can be clicked. Returns false if there is no room;
  /// end_dialog() must then not be called.
  bool begin_dialog(float width);
  void end_dialog();

  /// True if the frame must be drawn again, because the size of a dialog is known only after its first frame.
  bool needs_another_frame() const { return needs_another_frame_; }
  std::vector<DrawnText> take_texts() { return std::move(texts_); }
  std::vector<Box> take_panels() { return std::move(panels_); }

 private:
  float scale_;
  int panel_depth_ = 0;
  bool dialog_shown_ = false, needs_another_frame_ = false;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
};

}  // namespace gelslam::viewer
