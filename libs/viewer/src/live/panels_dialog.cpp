#include <algorithm>
#include <array>

#include "ui/panels.hpp"
#include "ui/window_cards.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double padding = 26;
const ImU32 shade = IM_COL32(8, 10, 12, 150);

/// A card in the middle of the window, over everything.
Box open_card(Canvas& canvas, float width, float height) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  canvas.cover(shade);
  const Box card{0.5F * (window.x - width), std::max(0.0F, 0.5F * (window.y - height)), width, height};
  canvas.panel(card, theme::with_alpha(theme::panel, 1), 12);
  canvas.frame(card, theme::line, 12);
  return card;
}

struct Answer {
  std::string label, key;
  ImU32 ink = theme::text;
};

/// Title, sentence, and a row of answers; which was clicked, or -1.
int draw_question(Canvas& canvas, const std::string& title, const std::string& sentence,
                  const std::vector<Answer>& answers) {
  const WindowFonts& fonts = canvas.fonts();
  const float gap = canvas.px(12), button_height = canvas.px(54);
  float row = -gap;
  for (const Answer& answer : answers) row += canvas.width_of(fonts.body, answer.label) + canvas.px(44) + gap;
  const float most = ImGui::GetIO().DisplaySize.x - canvas.px(2 * padding);
  const float inner = std::min(std::max(row, canvas.px(430)), most - canvas.px(16));
  const float sentence_height = canvas.height_of(fonts.body, sentence, inner);
  const float height = fonts.title->FontSize + sentence_height + button_height + canvas.px(2 * padding + 34);
  const Box card = open_card(canvas, inner + canvas.px(2 * padding), height);
  const float x = card.x + canvas.px(padding);
  float y = card.y + canvas.px(padding);
  canvas.text(fonts.figure, x, y, theme::text, title);
  y += fonts.title->FontSize + canvas.px(12);
  canvas.text_wrapped(fonts.body, x, y, inner, theme::gray, sentence);
  y += sentence_height + canvas.px(22);
  // Where the row is wider than the card, the answers share it.
  const float shrink = std::min(1.0F, inner / row);
  int clicked = -1;
  float at = x;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const float width = (canvas.width_of(fonts.body, answers[i].label) + canvas.px(44)) * shrink;
    if (canvas.button({at, y, width, button_height}, answers[i].label, answers[i].key, theme::raised,
                      answers[i].ink))
      clicked = static_cast<int>(i);
    at += width + gap * shrink;
  }
  return clicked;
}

void draw_yes_no(Canvas& canvas, const LiveFrame& frame, LiveControls& controls, const std::string& title,
                 const std::string& sentence, const std::string& yes, const std::string& no) {
  const int answer = draw_question(canvas, title, sentence, {{yes, "Enter", theme::blue}, {no, "Esc"}});
  if (answer == 0) controls.accept(frame.time_s);
  if (answer == 1) controls.refuse();
}

void draw_stop(Canvas& canvas, const LiveFrame& frame, LiveControls& controls) {
  if (frame.output_folder.empty())
    return draw_yes_no(
        canvas, frame, controls, "Stop the scan?",
        "Loops are closed and the mesh is made, but nothing is kept (no -o): export it afterwards.", "Stop",
        "Go on scanning");
  draw_yes_no(canvas, frame, controls, "Stop the scan?",
              "Loops are closed, the mesh is made, and everything is saved in " + frame.output_folder + ".",
              "Stop and save", "Go on scanning");
}

void draw_export(Canvas& canvas, LiveControls& controls) {
  const int answer = draw_question(
      canvas, "Export the mesh", "As it is now, in millimetres, at full resolution.",
      {{"PLY", "P", theme::blue}, {"OBJ", "O", theme::blue}, {"STL", "S", theme::blue}, {"Cancel", "Esc"}});
  constexpr std::array<const char*, 3> formats = {"ply", "obj", "stl"};
  if (answer >= 0 && answer < 3) controls.choose_format(formats[static_cast<std::size_t>(answer)]);
  if (answer == 3) controls.refuse();
}

std::vector<HelpLine> help_lines() {
  std::vector<HelpLine> lines;
  for (const auto& binding : window_keys()) lines.push_back({binding.key_name, binding.what});
  lines.push_back({"Left drag", "Turn"});
  lines.push_back({"Right drag", "Move"});
  lines.push_back({"Wheel", "Nearer, further"});
  lines.push_back({"Double click", "Turn about this place"});
  return lines;
}

void draw_help(Canvas& canvas) {
  const WindowFonts& fonts = canvas.fonts();
  const std::vector<HelpLine> lines = help_lines();
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const bool wide = window.x > canvas.px(880);
  const std::size_t columns = wide ? 2 : 1, rows = (lines.size() + columns - 1) / columns;
  const float head = fonts.title->FontSize + canvas.px(18);
  const float most = window.y - canvas.px(2 * padding) - head;
  // In a small window the lines move together rather than run out of it.
  ImFont* font =
      most / static_cast<float>(rows) >= fonts.body->FontSize + canvas.px(2) ? fonts.body : fonts.small;
  const float row = std::min(fonts.body->FontSize + canvas.px(11), most / static_cast<float>(rows));
  const float column =
      std::min(canvas.px(410), (window.x - canvas.px(2 * padding)) / static_cast<float>(columns));
  const float key_width = std::min(canvas.px(120), 0.3F * column);
  const Box card = open_card(canvas, column * static_cast<float>(columns) + canvas.px(2 * padding),
                             head + row * static_cast<float>(rows) + canvas.px(2 * padding));
  const float left = card.x + canvas.px(padding), top = card.y + canvas.px(padding);
  canvas.text(fonts.figure, left, top, theme::text, "Keys and mouse");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const float x = left + column * static_cast<float>(i / rows);
    const float y = top + head + row * static_cast<float>(i % rows);
    canvas.text(font, x, y, theme::blue, lines[i].key);
    canvas.text(font, x + key_width, y, theme::text, lines[i].what);
  }
}

}  // namespace

void draw_dialog(Canvas& canvas, const LiveFrame& frame, LiveControls& controls) {
  switch (controls.dialog()) {
    case Dialog::help:
      return draw_help(canvas);
    case Dialog::choose_export:
      return draw_export(canvas, controls);
    case Dialog::confirm_stop:
      return draw_stop(canvas, frame, controls);
    case Dialog::confirm_new_scan:
      return draw_yes_no(
          canvas, frame, controls, "Start a new scan?",
          frame.status.log_bytes > 0
              ? "The map so far is forgotten. The recording goes on, with all there was until now."
              : "The map so far is forgotten, and there is no recording to make it again from.",
          "Forget the map", "Keep it");
    case Dialog::confirm_leave:
      return draw_yes_no(canvas, frame, controls, "Close the window?",
                         "The scan is still being saved. That goes on without the window.", "Close",
                         "Wait here");
    case Dialog::none:
      return;
  }
}

}  // namespace gelslam::viewer::detail
