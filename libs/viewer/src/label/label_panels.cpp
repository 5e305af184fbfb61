#include "label/label_panels.hpp"

#include <algorithm>

#include "ui/button_bar.hpp"
#include "ui/window_cards.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double bar_height = 62, strip_height = 26, side_width = 300, head_height = 64, margin = 16;
constexpr double least_width_with_side = 760;
const ImU32 shade = IM_COL32(0, 0, 0, 150);

struct LabelButton {
  LabelAction action;
  const char* label;
  int group, priority;  ///< see BarItem
  ImU32 ink = theme::text;
};

std::vector<LabelButton> buttons_of(const LabelControls& controls) {
  using enum LabelAction;
  return {{accept, "Accept", 0, 1, theme::green},
          {back, "Back", 0, 3},
          {leave_out, "Leave out", 0, 2},
          {accept_rest, "Accept the rest", 0, 4},
          {difference, "Difference", 1, 5, controls.shows_difference() ? theme::blue : theme::text},
          {use_found, "As found", 1, 6},
          {undo, "Undo", 1, 5},
          {save, "Save", 2, 7},
          {help, "Help", 2, 3},
          {quit, "Save and end", 2, 0}};
}

void draw_buttons(Canvas& canvas, const Box& bar, double now_s, LabelControls& controls) {
  const std::vector<LabelButton> buttons = buttons_of(controls);
  std::vector<BarItem> items;
  for (const LabelButton& button : buttons)
    items.push_back(
        {button.label, key_name_of(label_keys(), button.action), button.group, button.priority, button.ink});
  if (const auto clicked = draw_button_bar(canvas, bar, items))
    controls.perform(buttons[*clicked].action, now_s);
}

/// One mark per press, in the order they are shown.
void draw_strip(Canvas& canvas, const LabelLayout& layout, const LabelSession& session) {
  canvas.panel(layout.strip, theme::with_alpha(theme::panel, 1), 0);
  const auto& labels = session.labels();
  for (std::size_t k = 0; k < labels.size(); ++k) {
    const Box mark = layout.mark(k, labels.size());
    canvas.fill(mark, color_of(labels[k]), 2);
    if (k == session.current()) canvas.frame(mark.inset(-canvas.px(3)), theme::text, 3, 2);
  }
}

void draw_circle(Canvas& canvas, const LabelLayout& layout, const ContactCircle& circle, ImU32 color,
                 double thickness) {
  const float x = layout.x_of(circle.u_px), y = layout.y_of(circle.v_px),
              radius = static_cast<float>(circle.radius_px) * layout.enlargement;
  canvas.ring(x, y, radius, shade, thickness + 2, layout.picture);
  canvas.ring(x, y, radius, color, thickness, layout.picture);
}

void draw_cross(Canvas& canvas, const LabelLayout& layout, const ContactCircle& circle, ImU32 color) {
  const float x = layout.x_of(circle.u_px), y = layout.y_of(circle.v_px), arm = canvas.px(9),
              half = canvas.px(0.75);
  if (!layout.picture.inset(arm).contains(static_cast<double>(x), static_cast<double>(y))) return;
  canvas.fill({x - arm, y - half, 2 * arm, 2 * half}, color);
  canvas.fill({x - half, y - arm, 2 * half, 2 * arm}, color);
}

void draw_press(Canvas& canvas, const LabelLayout& layout, const LabelSession& session,
                const WindowTexture& picture, const LabelControls& controls) {
  canvas.image(picture.id(), layout.picture, 0);
  const PressLabel& label = session.label();
  if (label.origin != LabelOrigin::found && session.found().problem.empty())
    draw_circle(canvas, layout, session.found().circle, theme::with_alpha(theme::text, 0.55), 1);
  const ImU32 color = label.state == LabelState::open ? theme::text : color_of(label);
  draw_circle(canvas, layout, label.circle, color, controls.drags_rim() ? 3 : 2);
  draw_cross(canvas, layout, label.circle, color);
}

void draw_head(Canvas& canvas, const Box& view, const LabelSession& session) {
  const float x = view.x + canvas.px(margin);
  canvas.text(canvas.fonts().title, x, view.y + canvas.px(10), theme::text, session.progress());
  const std::string& doubt = session.label().doubt;
  const std::string line = session.press().name + (doubt.empty() ? "" : ": " + doubt);
  canvas.text(canvas.fonts().body, x, view.y + canvas.px(38), doubt.empty() ? theme::dim : theme::amber,
              canvas.fitted(canvas.fonts().body, line, view.width - canvas.px(2 * margin), Cut::end));
}

std::vector<HelpLine> help_lines() {
  std::vector<HelpLine> lines;
  for (const auto& key : label_keys())
    if (*key.key_name != '\0') lines.push_back({key.key_name, key.what});
  lines.insert(lines.end(), {{"Drag", "Move the circle"}, {"Drag its rim", "Radius"}, {"Wheel", "Radius"}});
  return lines;
}

}  // namespace

Box LabelLayout::mark(std::size_t label, std::size_t labels) const {
  const float room = strip.width / static_cast<float>(labels),
              width = std::min(room * 0.7F, strip.height * 0.5F);
  return {strip.x + room * (static_cast<float>(label) + 0.5F) - 0.5F * width, strip.y + 0.25F * strip.height,
          width, 0.5F * strip.height};
}

std::optional<std::size_t> LabelLayout::label_at(double x, double y, std::size_t labels) const {
  if (!strip.contains(x, y)) return std::nullopt;
  const double share = (x - static_cast<double>(strip.x)) / static_cast<double>(strip.width);
  return std::min(labels - 1, static_cast<std::size_t>(share * static_cast<double>(labels)));
}

LabelLayout lay_out_labels(const Canvas& canvas, float width_px, float height_px, const cv::Size& press) {
  LabelLayout layout;
  layout.view = {0, 0, width_px, height_px};
  if (height_px > canvas.px(4 * bar_height)) {
    layout.bar = {0, height_px - canvas.px(bar_height), width_px, canvas.px(bar_height)};
    layout.strip = {0, layout.bar.y - canvas.px(strip_height), width_px, canvas.px(strip_height)};
    layout.view.height = layout.strip.y;
  }
  if (width_px > canvas.px(least_width_with_side)) {
    layout.side = {width_px - canvas.px(side_width), 0, canvas.px(side_width), layout.view.height};
    layout.view.width = layout.side.x;
  }
  const float head = std::min(canvas.px(head_height), 0.25F * layout.view.height);
  const float width = layout.view.width, height = layout.view.height - head;
  layout.enlargement = std::max(
      0.01F, std::min(width / static_cast<float>(press.width), height / static_cast<float>(press.height)));
  layout.picture.width = layout.enlargement * static_cast<float>(press.width);
  layout.picture.height = layout.enlargement * static_cast<float>(press.height);
  layout.picture.x = layout.view.x + 0.5F * (width - layout.picture.width);
  layout.picture.y = layout.view.y + head + 0.5F * (height - layout.picture.height);
  return layout;
}

ImU32 color_of(const PressLabel& label) {
  if (label.state == LabelState::accepted) return theme::green;
  if (label.state == LabelState::left_out) return theme::line;
  return label.doubt.empty() ? theme::gray : theme::amber;
}

void draw_label_panels(Canvas& canvas, const LabelLayout& layout, const LabelSession& session,
                       const WindowTexture& picture, double pixel_pitch_mm, double now_s,
                       LabelControls& controls) {
  draw_press(canvas, layout, session, picture, controls);
  draw_head(canvas, layout.view, session);
  if (layout.side.width > 0) draw_label_side(canvas, layout.side, session, pixel_pitch_mm);
  draw_note(canvas, layout.view, controls.message());
  if (layout.bar.width > 0) {
    draw_strip(canvas, layout, session);
    draw_buttons(canvas, layout.bar, now_s, controls);
  }
  if (controls.shows_help()) draw_help_card(canvas, layout.view, help_lines());
}

}  // namespace gelslam::viewer::detail
