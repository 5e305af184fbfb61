#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gelslam/core/text.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "live/live_window.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kPadding = 14, kMargin = 18, kDiagnosticsWidth = 270;  // design pixels
constexpr std::int64_t kLowDiskBytes = 2'000'000'000;

Figure free_disk(std::int64_t bytes) {
  return {"Disk free", bytes < 0 ? "-" : bytes_text(bytes),
          bytes >= 0 && bytes < kLowDiskBytes ? Tone::red : Tone::gray};
}

Color color_of_value(const Figure& figure) {
  return figure.tone == Tone::gray ? theme::kText : color_of(figure.tone);
}

void draw_figures(Ui& ui, const char* id, const std::vector<Figure>& figures) {
  if (!ui.begin_table(id, 2)) return;
  for (const Figure& figure : figures) {
    ui.next_cell();
    ui.text(Face::small, theme::kDim, figure.label);
    ui.text(Face::figure, color_of_value(figure), figure.value);
    ui.gap(9);
  }
  ui.end_table();
}

float aspect_of(const Texture& picture) { return picture.empty() ? 0.75F : picture.aspect(); }

/// Draws an image at the current position of the panel; `without` is the text shown if there is no image.
Box draw_picture(Ui& ui, float width, const Texture& picture, double rounding, const char* without) {
  const Box box{ui.room().x, ui.room().y, width, width * aspect_of(picture)};
  if (picture.empty()) {
    ui.fill(box, theme::kRaised, rounding);
    ui.text_centered(Face::small, box, theme::kDim, without);
  } else {
    ui.image(picture, box, rounding);
  }
  return box;
}

}  // namespace

void draw_pictures(Ui& ui, float height, const LiveFrame& frame) {
  const float head = ui.height_of(Face::small) + ui.px(4), each = 0.5F * (height - ui.px(20)) - head;
  const auto draw = [&](const char* label, const Texture& picture, const char* without) {
    ui.text(Face::small, theme::kDim, label);
    ui.gap(4);
    const float width = std::max(1.0F, std::min(ui.room().width, each / aspect_of(picture)));
    ui.gap(static_cast<double>(draw_picture(ui, width, picture, 6, without).height / ui.px(1)));
  };
  draw("Touch and contact", frame.tactile, "no picture yet");
  ui.gap(10);
  draw("Normals", frame.normals, "no surface yet");
}

float draw_banner(Ui& ui, const Box& view, const LiveFrame& frame, double now_s) {
  const StateWords& words = frame.words;
  const float x = view.x + ui.px(kMargin), most = std::min(view.width - ui.px(2 * kMargin), ui.px(620));
  const bool fits = ui.width_of(Face::headline, words.headline) <= most - ui.px(45);
  std::vector<Paragraph> text = {
      {fits ? Face::headline : Face::figure, color_of(words.tone), words.headline}};
  if (!words.advice.empty()) text.push_back({Face::title, theme::kText, words.advice});
  Box box = ui.card(x, view.y + ui.px(kMargin), most, color_of(words.tone), text, 0, 0, 240);
  if (words.state == "finishing" || words.state == "background") {
    // An animated bar shows that work is going on, without an estimate of its duration.
    const auto share = static_cast<float>(0.5 - 0.5 * std::cos(1.8 * now_s));
    const Box bar{box.x + ui.px(27), box.bottom() - ui.px(7), box.width - ui.px(45), ui.px(5)};
    ui.fill(bar, theme::kRaised, 3);
    ui.fill({bar.x + 0.75F * share * bar.width, bar.y, 0.25F * bar.width, bar.height}, theme::kBlue, 3);
  }
  std::vector<Paragraph> warnings;
  for (const std::string& warning : frame.status.warnings)
    warnings.push_back({Face::body, theme::kText, sentences(warning)});
  if (!warnings.empty()) box = ui.card(x, box.bottom() + ui.px(10), most, theme::kAmber, warnings);
  return box.bottom();
}

void draw_side(Ui& ui, const Box& side, const LiveFrame& frame) {
  ui.begin_panel("##side", side, kPadding);
  ui.row(Face::small, frame.status.source, duration_text(frame.status.age_s), theme::kText, Cut::middle);
  ui.gap(8);
  const float figures = 2 * (ui.height_of(Face::small) + ui.height_of(Face::figure) + ui.px(9));
  ui.begin_child("##upper", ui.room().height - figures);
  draw_pictures(ui, ui.room().height, frame);
  ui.end_child();
  draw_figures(ui, "##figures", usual_figures(frame.status));
  ui.end_panel();
}

void draw_diagnostics(Ui& ui, const Box& view, const LiveFrame& frame) {
  const float width = ui.px(kDiagnosticsWidth);
  ui.begin_panel("##diagnostics", {view.right() - width - ui.px(kMargin), view.y + ui.px(kMargin), width, 0},
                 kPadding, 10);
  std::vector<Figure> figures = further_figures(frame.status);
  figures.push_back(free_disk(frame.disk_free_bytes));
  draw_figures(ui, "##further", figures);
  ui.end_panel();
}

namespace {

constexpr double kCardPadding = 20, kCardMargin = 18, kMaxWidth = 720, kMinHeight = 180;  // design pixels
constexpr Color kSensor = theme::rgb(255, 150, 40);  ///< Same color as the sensor's outline in the scene.

struct Step {
  const char *title, *sentence;
};
constexpr Step kSteps[] = {
    {"Bare gel", "Nothing touches it until its background is measured."},
    {"Press", "Press the object in by half a millimeter: enough that its texture shows."},
    {"Roll slowly", "Then come back to where you began, so that the loop closes."},
};

int step_now(const LiveFrame& frame) {
  if (frame.words.state == "background") return 0;
  return frame.status.track == TrackStatus::no_contact ? 1 : 2;
}

void draw_steps(Ui& ui, const LiveFrame& frame) {
  const int now = step_now(frame);
  for (int i = 0; i < 3; ++i) {
    const Step& step = kSteps[i];
    const Color color = i < now ? theme::kGreen : i == now ? theme::kBlue : theme::kLine;
    const Box place = ui.room();
    const float radius = ui.px(13);
    ui.disc(place.x + radius, place.y + radius, radius, color);
    ui.text_centered(Face::body, {place.x, place.y, 2 * radius, 2 * radius},
                     i > now ? theme::kText : theme::kBackdrop, std::to_string(i + 1));
    ui.indent(38);
    ui.text(Face::title, i > now ? theme::kDim : theme::kText, step.title);
    ui.gap(2);
    ui.paragraph(Face::body, i == now ? theme::kText : theme::kDim, step.sentence);
    ui.indent(-38);
    ui.gap(i < 2 ? 16 : 0);
  }
}

/// Draws the camera's image in the sensor's outline, with a circle where to press.
void draw_gel(Ui& ui, const LiveFrame& frame) {
  const Box box = draw_picture(ui, ui.room().width, frame.tactile, 8, "");
  ui.frame(box, kSensor, 8, 2);
  if (step_now(frame) == 1)
    ui.ring(box.x + 0.5F * box.width, box.y + 0.5F * box.height, 0.28F * box.height, theme::kText, 2, box);
  ui.gap(static_cast<double>(box.height / ui.px(1)) + 6);
  ui.text(Face::small, theme::kDim, "The gel, as the camera sees it");
}

std::vector<Figure> facts_of(const LiveFrame& frame) {
  const LiveStatus& s = frame.status;
  std::vector<Figure> facts = {{"Keyframes", text_of_count(s.keyframes)}};
  if (const Eigen::Vector3f size = frame.mesh_mm.sizes(); !frame.mesh_mm.isEmpty())
    facts.push_back({"Size", fmt::format("{:.1f} x {:.1f} x {:.1f} mm", size.x(), size.y(), size.z())});
  const double mm = s.saved_drift_mm, deg = s.saved_drift_deg;
  if (mm > 0)
    facts.push_back({"Pose uncertainty (2 sigma)", fmt::format("{:.2f} mm, {:.1f}\u00b0", mm, deg),
                     mm > kLargeDriftMm || deg > kLargeDriftDeg ? Tone::amber : Tone::gray});
  facts.push_back(
      {"Not joined",
       s.components > 1 ? fmt::format("{} of {} components", s.components - 1, s.components) : "nothing",
       s.components > 1 ? Tone::amber : Tone::gray});
  return facts;
}

}  // namespace

void draw_start(Ui& ui, const Box& view, const LiveFrame& frame) {
  if (view.height < ui.px(kMinHeight)) return;
  const float width = std::min(ui.px(kMaxWidth), view.width - ui.px(2 * kCardMargin));
  ui.begin_panel("##start", {view.x + 0.5F * view.width, view.y + 0.5F * view.height, width, 0}, kCardPadding,
                 10, 0.5F, 0.5F);
  const bool has_room = width >= ui.px(560) && view.height >= ui.px(330);
  if (!has_room) {
    draw_steps(ui, frame);
  } else if (ui.begin_table("##both", 2, 24)) {
    ui.next_cell();
    draw_gel(ui, frame);
    ui.next_cell();
    draw_steps(ui, frame);
    ui.end_table();
  }
  ui.end_panel();
}

float draw_end(Ui& ui, const Box& view, const LiveFrame& frame) {
  if (view.height < ui.px(kMinHeight)) return 0;
  const float width = std::min(ui.px(380), view.width - ui.px(2 * kCardMargin));
  ui.begin_panel("##end", {view.x + ui.px(kCardMargin), view.y + ui.px(10), width, 0}, 16, 10);
  for (const Figure& fact : facts_of(frame)) {
    ui.row(Face::body, fact.label, fact.value, color_of_value(fact));
    ui.gap(5);
  }
  if (!frame.output_folder.empty()) {
    ui.gap(4);
    ui.text(Face::small, theme::kDim, "Saved in");
    ui.paragraph(Face::body, theme::kText, frame.output_folder);
  }
  if (!frame.output_folder.empty() && !frame.mesh_mm.isEmpty()) {
    ui.gap(6);
    ui.text(Face::small, theme::kDim, "To print or share it");
    ui.paragraph(Face::body, theme::kText, "gelslam export " + frame.output_folder + " -o object.stl");
  }
  ui.end_panel();
  return width + ui.px(kCardMargin);
}

}  // namespace gelslam::viewer::detail
