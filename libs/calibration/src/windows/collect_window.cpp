#include "windows/collect_window.hpp"

#include <algorithm>
#include <string>

namespace gelslam::calibration::detail {
namespace {

using viewer::Action;
using viewer::Box;
using viewer::Color;
using viewer::Face;
using viewer::Ui;
namespace theme = viewer::theme;

constexpr int kSide = PressCoverage::kSide;
constexpr Color kThirds = theme::rgb(150, 150, 150);
constexpr double kCollectSideWidth = 360, kCollectMargin = 20, kKeyGap = 14;  // design pixels

/// Lines between the ninths, and the circle that was found.
void draw_over_picture(Ui& ui, const Box& place, const CollectView& view) {
  for (int k = 1; k < kSide; ++k) {
    const float x = place.x + static_cast<float>(k) * place.width / kSide,
                y = place.y + static_cast<float>(k) * place.height / kSide;
    ui.line(x, place.y, x, place.bottom(), kThirds, 1, place);
    ui.line(place.x, y, place.right(), y, kThirds, 1, place);
  }
  if (!view.circle) return;
  const double scale = static_cast<double>(place.width) / view.bgr.cols;
  const auto length = [scale](double px) { return static_cast<float>(scale * px); };
  ui.ring(place.x + length(view.circle->u_px + 0.5), place.y + length(view.circle->v_px + 0.5),
          length(view.circle->radius_px), view.circle_is_good ? theme::kGreen : theme::kAmber, 2, place);
}

/// The picture, and in each ninth of it what is missing there, or else what was taken.
void draw_picture(Ui& ui, const Box& place, const viewer::Texture& picture, const CollectView& view) {
  ui.begin_panel("##picture", place, 0, 6);
  ui.image(picture, place);
  draw_over_picture(ui, place, view);
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

void draw_keys(Ui& ui, const viewer::Controls& controls) {
  if (!ui.begin_table("##keys", 2, kKeyGap, true)) return;
  for (const viewer::ActionRow& row : controls.rows()) {
    ui.next_cell();
    ui.gap(kKeyGap);
    ui.text(Face::body, theme::kDim, row.key, viewer::Cut::none);
    ui.next_cell();
    ui.gap(kKeyGap);
    ui.text(Face::body, theme::kDim, row.help, viewer::Cut::none);
  }
  ui.end_table();
}

void draw_side(Ui& ui, const Box& box, const CollectView& view, const viewer::Controls& controls) {
  const auto paragraph = [&ui](Face face, Color color, const std::string& text, double gap) {
    if (text.empty()) return;
    ui.paragraph(face, color, text);
    ui.gap(gap);
  };
  ui.begin_panel("##side", box, kCollectMargin, 10);
  const float keys = static_cast<float>(controls.rows().size()) * (ui.height_of(Face::body) + ui.px(kKeyGap));
  ui.begin_child("##state", ui.room().height - keys);
  const int presses = view.coverage.total(), wanted = view.coverage.wanted();
  paragraph(Face::small, theme::kDim, "BALL PRESSES", 6);
  paragraph(Face::figure, theme::kText, std::to_string(presses) + " of " + std::to_string(wanted), 10);
  ui.bar(static_cast<double>(presses) / wanted, 0, view.coverage.enough() ? theme::kGreen : theme::kBlue, 10);
  ui.gap(24);
  paragraph(Face::title, view.circle_is_good || view.coverage.enough() ? theme::kGreen : theme::kText,
            view.headline, 10);
  paragraph(Face::body, theme::kText, view.hint, 18);
  paragraph(Face::body, theme::kAmber, view.warning, 18);
  ui.end_child();
  draw_keys(ui, controls);
  ui.end_panel();
}

}  // namespace

CollectControls::CollectControls(CollectWatch& session)
    : Controls({{Action::undo, "u", "U", "", 0, 0, "take the last press back"},
                {Action::close, "q esc", "Q", "", 0, 0, "end; all presses are kept"}}),
      session_(session) {}

void CollectControls::act(Action action, double /*now_s*/) {
  if (action == Action::undo) session_.take_back();
  if (action == Action::close) close();
}

CollectWindow::CollectWindow(CollectWatch& session, const CollectWindowOptions& options)
    : WindowLoop(options), session_(session), controls_(session) {}

bool CollectWindow::advance(double /*now_s*/, double /*dt_s*/) {
  shown_ = session_.view();
  texture_.set(shown_.bgr);
  return true;
}

void CollectWindow::draw_frame(Ui& ui, double /*now_s*/) {
  ui.fill(ui.window(), theme::kBackdrop);
  const float gap = ui.px(kCollectMargin);
  Box left = ui.window().inset(gap);
  const Box right = left.cut_right(std::min(ui.px(kCollectSideWidth), 0.45F * left.width));
  left.cut_right(gap);
  set_view(left);
  draw_side(ui, right, shown_, controls_);
  if (shown_.bgr.empty())
    return ui.text_centered(Face::body, left, theme::kDim, "Waiting for the first picture");
  draw_picture(ui, left.largest(texture_.aspect()), texture_, shown_);
}

}  // namespace gelslam::calibration::detail

namespace gelslam {

void run_collect_window(CollectWatch& session, const CollectWindowOptions& options) {
  calibration::detail::CollectWindow(session, options).run();
}

void write_collect_snapshot(CollectWatch& session, const CollectWindowOptions& options) {
  CollectWindowOptions hidden = options;
  hidden.visible = false;
  viewer::write_png(options.snapshot, calibration::detail::CollectWindow(session, hidden).picture(0.01));
}

}  // namespace gelslam
