#include <algorithm>
#include <cmath>

#include "gelslam/core/text.hpp"
#include "live/live_window.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double kPadding = 14, kMargin = 18, kDiagnosticsWidth = 270;  // design pixels
constexpr std::int64_t kLowDiskBytes = 2'000'000'000;

Figure free_disk(std::int64_t bytes) {
  return {"Disk free", bytes < 0 ? "-" : bytes_text(bytes),
          bytes >= 0 && bytes < kLowDiskBytes ? Tone::red : Tone::gray};
}

void draw_figures(Ui& ui, const char* id, const std::vector<Figure>& figures) {
  if (!ui.begin_table(id, 2)) return;
  for (const Figure& figure : figures) {
    ui.next_cell();
    ui.text(Face::small, theme::kDim, figure.label);
    ui.text(Face::figure, figure.tone == Tone::gray ? theme::kText : color_of(figure.tone), figure.value);
    ui.gap(9);
  }
  ui.end_table();
}

void draw_picture(Ui& ui, float height, const char* label, const Texture& picture, const char* without) {
  const float head = ui.height_of(Face::small) + ui.px(4);
  const float aspect = picture.empty() ? 0.75F : picture.aspect();
  const float width = std::max(1.0F, std::min(ui.room().width, (height - head) / aspect));
  ui.text(Face::small, theme::kDim, label);
  ui.gap(4);
  const Box box{ui.room().x, ui.room().y, width, width * aspect};
  if (picture.empty()) {
    ui.fill(box, theme::kRaised, 6);
    ui.text_centered(Face::small, box, theme::kDim, without);
  } else {
    ui.image(picture, box);
  }
  ui.gap(static_cast<double>(box.height / ui.px(1)));
}

}  // namespace

void draw_pictures(Ui& ui, float height, const Texture& tactile, const Texture& normals) {
  const float each = 0.5F * (height - ui.px(20));
  draw_picture(ui, each, "Touch and contact", tactile, "no picture yet");
  ui.gap(10);
  draw_picture(ui, each, "Normals", normals, "no surface yet");
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
    // A bar that says "something is going on", without claiming to know how long.
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
  draw_pictures(ui, ui.room().height, *frame.tactile, *frame.normals);
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

}  // namespace gelslam::viewer::detail
