#include <algorithm>
#include <cmath>

#include "gelslam/core/text.hpp"
#include "label/label_panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double padding = 20;

/// Writes lines one below the other.
class Column {
 public:
  Column(Canvas& canvas, const Box& side)
      : canvas_(canvas),
        x_(side.x + canvas.px(padding)),
        y_(side.y + canvas.px(padding)),
        width_(side.width - canvas.px(2 * padding)) {}

  float x() const { return x_; }
  float y() const { return y_; }
  float width() const { return width_; }
  void skip(double design_px) { y_ += canvas_.px(design_px); }
  void line(ImFont* font, ImU32 color, const std::string& text) {
    if (text.empty()) return;
    y_ += canvas_.text_wrapped(font, x_, y_, width_, color, text) + canvas_.px(6);
  }
  void figure(const std::string& name, const std::string& value) {
    canvas_.text(canvas_.fonts().body, x_, y_, theme::dim, name);
    canvas_.text_right(canvas_.fonts().body, x_ + width_, y_, theme::text, value);
    y_ += canvas_.fonts().body->FontSize + canvas_.px(6);
  }

 private:
  Canvas& canvas_;
  float x_, y_, width_;
};

const char* words_of(LabelState state) {
  switch (state) {
    case LabelState::accepted:
      return "Accepted";
    case LabelState::left_out:
      return "Left out";
    case LabelState::open:
      break;
  }
  return "Not decided";
}

std::string origin_of(const LabelSession& session) {
  switch (session.label().origin) {
    case LabelOrigin::from_file:
      return "from its file";
    case LabelOrigin::by_hand:
      return "moved by hand";
    case LabelOrigin::found:
      break;
  }
  if (!session.found().problem.empty()) return "not found, only put there";
  return format_text("found, confidence %.2f", session.found().confidence);
}

/// How deep a ball reaches below the undeformed gel if it touches it up to this circle, at least.
double depth_mm(double contact_mm, double diameter_mm) {
  const double ball_mm = 0.5 * diameter_mm;
  return ball_mm - std::sqrt(std::max(0.0, ball_mm * ball_mm - contact_mm * contact_mm));
}

/// The gel with all contacts on it: what is accepted, and what is shown.
void draw_map(Canvas& canvas, const Box& map, const LabelSession& session) {
  canvas.fill(map, theme::raised, 4);
  const float scale = map.width / static_cast<float>(session.set().background.cols);
  const auto draw = [&](const PressLabel& label, ImU32 color, double thickness) {
    canvas.ring(map.x + static_cast<float>(label.circle.u_px) * scale,
                map.y + static_cast<float>(label.circle.v_px) * scale,
                static_cast<float>(label.circle.radius_px) * scale, color, thickness, map);
  };
  for (const PressLabel& label : session.labels())
    if (label.state != LabelState::left_out) draw(label, theme::with_alpha(color_of(label), 0.6), 1);
  draw(session.label(), theme::text, 2);
}

}  // namespace

void draw_label_side(Canvas& canvas, const Box& side, const LabelSession& session, double pixel_pitch_mm) {
  canvas.panel(side, theme::with_alpha(theme::panel, 1), 0);
  const PressLabel& label = session.label();
  const WindowFonts& fonts = canvas.fonts();
  Column column(canvas, side);
  column.line(fonts.title, theme::text, canvas.fitted(fonts.title, session.press().name, column.width()));
  column.line(fonts.body, theme::dim,
              format_text("press %zu of %zu, ball of %.2f mm", session.current() + 1, session.labels().size(),
                          session.press().diameter_mm));
  column.skip(10);
  column.line(fonts.figure, label.state == LabelState::open ? theme::text : color_of(label),
              words_of(label.state));
  column.line(fonts.body, theme::dim, origin_of(session));
  column.line(fonts.body, theme::amber, label.doubt);
  column.skip(10);
  const double contact_mm = label.circle.radius_px * pixel_pitch_mm;
  column.figure("center", format_text("%.1f, %.1f px", label.circle.u_px, label.circle.v_px));
  column.figure("radius", format_text("%.1f px, %.2f mm", label.circle.radius_px, contact_mm));
  column.figure("depth, at least", format_text("%.2f mm", depth_mm(contact_mm, session.press().diameter_mm)));
  column.skip(10);
  const cv::Size picture = session.set().background.size();
  const float height =
      column.width() * static_cast<float>(picture.height) / static_cast<float>(picture.width);
  if (column.y() + height + canvas.px(2 * padding) > side.bottom()) return;
  column.line(fonts.small, theme::dim, "where the presses lie");
  draw_map(canvas, {column.x(), column.y(), column.width(), height}, session);
}

}  // namespace gelslam::viewer::detail
