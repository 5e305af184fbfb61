// Draws the window in which ball presses are collected and labeled. lay_out_presses() divides the window into
// areas; each of the other functions fills one of them: the picture of a press with the circle of its
// contact, the strip with one mark per press, the panel with the figures of a press, the picture of the
// camera with the number of presses in each ninth of the gel, and the panel that says what to do next.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "windows/press_window.hpp"

namespace gelslam::calibration::detail {
namespace {

using viewer::Box;
using viewer::Color;
using viewer::Face;
using viewer::Ui;
namespace theme = viewer::theme;

constexpr int kSide = PressCoverage::kSide;
constexpr Color kThirds = theme::rgb(150, 150, 150);  // the lines between the ninths of the gel
// Lengths in pixels of a window that is not enlarged (see Ui::px).
constexpr double kStripHeight = 26, kSideWidth = 300, kHeadHeight = 64, kMargin = 12, kSidePadding = 20;
constexpr Color kShade = theme::rgb(0, 0, 0, 150);  // beneath a circle, so that it is seen on any color

Color color_of(const PressLabel& label) {
  if (label.state == LabelState::accepted) return theme::kGreen;
  if (label.state == LabelState::left_out) return theme::kLine;
  return label.warning.empty() ? theme::kGray : theme::kAmber;
}

void draw_ring(Ui& ui, const PressLayout& layout, const ContactCircle& circle, Color color,
               double thickness) {
  ui.ring(layout.x_of(circle.u_px), layout.y_of(circle.v_px),
          static_cast<float>(circle.radius_px) * layout.enlargement, color, thickness, layout.picture);
}

void draw_contact(Ui& ui, const PressLayout& layout, const ContactCircle& circle, Color color,
                  double thickness) {
  draw_ring(ui, layout, circle, kShade, thickness + 2);
  draw_ring(ui, layout, circle, color, thickness);
}

void draw_cross(Ui& ui, const PressLayout& layout, const ContactCircle& circle, Color color) {
  const float x = layout.x_of(circle.u_px), y = layout.y_of(circle.v_px), arm = ui.px(9);
  ui.line(x - arm, y, x + arm, y, color, 1.5, layout.picture);
  ui.line(x, y - arm, x, y + arm, color, 1.5, layout.picture);
}

void draw_head(Ui& ui, const Box& head, const LabelSession& session) {
  const std::string& warning = session.label().warning;
  ui.begin_panel("##head", head, kMargin);
  ui.text(Face::title, theme::kText, session.progress());
  ui.gap(4);
  ui.text(Face::body, warning.empty() ? theme::kDim : theme::kAmber,
          session.press().name + (warning.empty() ? "" : ": " + warning));
  ui.end_panel();
}

const char* text_of(LabelState state) {
  constexpr const char* kTexts[] = {"Not decided", "Accepted", "Left out"};
  return kTexts[static_cast<std::size_t>(state)];
}

std::string origin_of(const LabelSession& session) {
  if (session.label().origin == LabelOrigin::from_file) return "from its file";
  if (session.label().origin == LabelOrigin::by_hand) return "moved by hand";
  if (!session.found().problem.empty()) return "not found, only put there";
  return fmt::format("found, confidence {:.2f}", session.found().confidence);
}

void add_paragraph(Ui& ui, Face face, Color color, const std::string& text, double gap) {
  if (text.empty()) return;
  ui.paragraph(face, color, text);
  ui.gap(gap);
}

/// Returns how deep the lowest point of a ball lies below the rim of its contact, whose radius is given. The
/// rim itself lies below the gel at rest, so the ball is pressed in at least this deep.
double depth_mm(double contact_mm, double diameter_mm) {
  const double ball_mm = 0.5 * diameter_mm;
  return ball_mm - std::sqrt(std::max(0.0, ball_mm * ball_mm - contact_mm * contact_mm));
}

}  // namespace

PressLayout lay_out_presses(const Ui& ui, const cv::Size& picture) {
  PressLayout layout;
  Box& view = layout.view = ui.window();
  if (view.height > ui.px(4 * viewer::kBarHeight)) {
    layout.bar = view.cut_bottom(ui.px(viewer::kBarHeight));
    layout.strip = view.cut_bottom(ui.px(kStripHeight));
  }
  layout.side = view.cut_right(std::min(ui.px(kSideWidth), 0.45F * view.width));
  layout.head = view.cut_top(std::min(ui.px(kHeadHeight), 0.25F * view.height));
  layout.picture = view;
  if (picture.empty()) return layout;
  layout.picture = view.largest(static_cast<float>(picture.height) / static_cast<float>(picture.width));
  layout.enlargement = std::max(0.01F, layout.picture.width / static_cast<float>(picture.width));
  return layout;
}

void draw_press(Ui& ui, const PressLayout& layout, const LabelSession& session,
                const viewer::Texture& picture, bool rim_is_held) {
  ui.image(picture, layout.picture, 0);
  const PressLabel& label = session.label();
  const Color color = label.state == LabelState::open ? theme::kText : color_of(label);
  draw_contact(ui, layout, label.circle, color, rim_is_held ? 3 : 2);
  draw_cross(ui, layout, label.circle, color);
  draw_head(ui, layout.head, session);
}

std::optional<std::size_t> draw_strip(Ui& ui, const PressLayout& layout, const LabelSession& session,
                                      bool has_camera, bool shows_camera) {
  const auto& labels = session.labels();
  const std::size_t marks = labels.size() + (has_camera ? 1 : 0),
                    shown = shows_camera ? labels.size() : session.current();
  const Box& strip = layout.strip;
  const float room = strip.width / static_cast<float>(marks),
              width = std::min(room * 0.7F, strip.height * 0.5F);
  ui.begin_panel("##strip", strip);
  for (std::size_t k = 0; k < marks; ++k) {
    const float middle = strip.x + room * (static_cast<float>(k) + 0.5F);
    const Box mark{middle - 0.5F * width, strip.y + 0.25F * strip.height, width, 0.5F * strip.height};
    ui.fill(mark, k < labels.size() ? color_of(labels[k]) : theme::kBlue, 2);
    if (k == shown) ui.frame(mark.inset(-ui.px(3)), theme::kText, 3, 2);
  }
  const std::optional<double> share = ui.held_share("##presses", strip);
  ui.end_panel();
  if (!share) return std::nullopt;
  const double place = std::clamp(*share, 0.0, 1.0) * static_cast<double>(marks);
  const auto mark = std::min(marks - 1, static_cast<std::size_t>(place));
  return mark == shown ? std::nullopt : std::optional(mark);
}

void draw_press_side(Ui& ui, const Box& side, const LabelSession& session, double pixel_pitch_mm) {
  const PressLabel& label = session.label();
  const double contact_mm = label.circle.radius_px * pixel_pitch_mm,
               diameter_mm = session.press().diameter_mm;
  ui.begin_panel("##side", side, kSidePadding);
  const auto figure = [&ui](const char* name, const std::string& value) {
    ui.row(Face::body, name, value);
    ui.gap(6);
  };
  ui.text(Face::title, theme::kText, session.press().name, viewer::Cut::start);
  ui.gap(6);
  add_paragraph(ui, Face::body, theme::kDim,
                fmt::format("press {} of {}, ball of {:.2f} mm", session.current() + 1,
                            session.labels().size(), diameter_mm),
                6);
  ui.gap(10);
  add_paragraph(ui, Face::figure, label.state == LabelState::open ? theme::kText : color_of(label),
                text_of(label.state), 6);
  add_paragraph(ui, Face::body, theme::kDim, origin_of(session), 6);
  add_paragraph(ui, Face::body, theme::kAmber, label.warning, 6);
  ui.gap(10);
  figure("center", fmt::format("{:.1f}, {:.1f} px", label.circle.u_px, label.circle.v_px));
  figure("radius", fmt::format("{:.1f} px, {:.2f} mm", label.circle.radius_px, contact_mm));
  figure("depth, at least", fmt::format("{:.2f} mm", depth_mm(contact_mm, diameter_mm)));
  ui.end_panel();
}

void draw_camera(Ui& ui, const PressLayout& layout, const CollectView& view, const viewer::Texture& picture) {
  const Box& place = layout.picture;
  if (view.bgr.empty())
    return ui.text_centered(Face::body, place, theme::kDim, "Waiting for the first picture");
  ui.begin_panel("##picture", place, 0, 6);
  ui.image(picture, place);
  for (int k = 1; k < kSide; ++k) {
    const float x = place.x + static_cast<float>(k) * place.width / kSide,
                y = place.y + static_cast<float>(k) * place.height / kSide;
    ui.line(x, place.y, x, place.bottom(), kThirds, 1, place);
    ui.line(place.x, y, place.right(), y, kThirds, 1, place);
  }
  if (view.circle)
    draw_ring(ui, layout, *view.circle, view.circle_is_good ? theme::kGreen : theme::kAmber, 2);
  if (ui.begin_table("##ninths", kSide)) {
    for (std::size_t zone = 0; zone < kSide * kSide; ++zone) {
      const int missing = view.coverage.missing(zone);
      ui.next_cell();
      ui.begin_child(press_zone_name(zone), place.height / kSide);
      ui.indent(8);
      ui.gap(8);
      ui.tag(Face::body, ui.room().x, ui.room().y, missing > 0 ? theme::kAmber : theme::kGreen,
             theme::with_alpha(theme::kPanel, 0.7),
             missing > 0 ? std::to_string(missing) + " more" : std::to_string(view.coverage.taken(zone)), 0,
             0);
      ui.end_child();
    }
    ui.end_table();
  }
  ui.end_panel();
}

void draw_camera_side(Ui& ui, const Box& side, const CollectView& view) {
  const int presses = view.coverage.total(), wanted = view.coverage.wanted();
  ui.begin_panel("##side", side, kSidePadding);
  add_paragraph(ui, Face::small, theme::kDim, "BALL PRESSES", 6);
  add_paragraph(ui, Face::figure, theme::kText, std::to_string(presses) + " of " + std::to_string(wanted),
                10);
  ui.bar(static_cast<double>(presses) / wanted, view.coverage.enough() ? theme::kGreen : theme::kBlue, 10);
  ui.gap(24);
  add_paragraph(ui, Face::title, view.circle_is_good || view.coverage.enough() ? theme::kGreen : theme::kText,
                view.headline, 10);
  add_paragraph(ui, Face::body, theme::kText, view.hint, 18);
  add_paragraph(ui, Face::body, theme::kAmber, view.warning, 18);
  ui.end_panel();
}

}  // namespace gelslam::calibration::detail
