#include <imgui.h>

#include <algorithm>

#include "gelslam/viewer/controls.hpp"

namespace gelslam::viewer {
namespace {

constexpr double kBarMargin = 9, kButtonGap = 4, kGroupGap = 16, kButtonPadding = 11;

struct BarButton {
  const ActionRow* row;
  ButtonLook look;
};

float button_width(const Ui& ui, const BarButton& button) {
  return std::max(ui.width_of(Face::body, button.look.label) + ui.px(2 * kButtonPadding),
                  ui.width_of(Face::small, button.row->key) + ui.px(kButtonPadding));
}

/// Draws a label with its key below it. Returns true when it was clicked.
bool draw_button(Ui& ui, const std::string& label, const std::string& key, Color ink, float width,
                 float height) {
  const Box box{ui.room().x, ui.room().y, std::max(1.0F, width), std::max(1.0F, height)};
  const bool clicked = ImGui::InvisibleButton(label.c_str(), {box.width, box.height});
  ui.fill(box,
          ImGui::IsItemActive()    ? theme::kLine
          : ImGui::IsItemHovered() ? theme::kHovered
                                   : theme::kRaised,
          7);
  const float body = ui.height_of(Face::body), small = ui.height_of(Face::small);
  const float top = box.y + 0.5F * (box.height - body - small);
  ui.text_centered(Face::body, {box.x, top, box.width, body}, ink, label);
  ui.text_centered(Face::small, {box.x, top + body, box.width, small}, theme::kDim, key);
  return clicked;
}

/// Returns the buttons that fit, in the order of their groups.
std::vector<BarButton> buttons_that_fit(const Ui& ui, const Controls& controls, float room) {
  std::vector<BarButton> buttons;
  for (const ActionRow& row : controls.rows()) {
    ButtonLook look = controls.button(row);
    if (!row.label.empty() && look.shown) buttons.push_back({&row, std::move(look)});
  }
  std::stable_sort(buttons.begin(), buttons.end(),
                   [](const BarButton& a, const BarButton& b) { return a.row->group < b.row->group; });
  const auto width = [&] {
    float sum = ui.px(2 * kBarMargin);
    for (std::size_t i = 0; i < buttons.size(); ++i) {
      if (i > 0) sum += ui.px(buttons[i].row->group == buttons[i - 1].row->group ? kButtonGap : kGroupGap);
      sum += button_width(ui, buttons[i]);
    }
    return sum;
  };
  int worst = 0;
  for (const BarButton& button : buttons) worst = std::max(worst, button.row->priority);
  for (; worst > 0 && width() > room; --worst)
    std::erase_if(buttons, [worst](const BarButton& b) { return b.row->priority == worst; });
  return buttons;
}

void draw_question(Ui& ui, const Question& question, Controls& controls, double now_s) {
  float widest = 0;
  for (const Answer& answer : question.answers)
    widest = std::max(widest, ui.width_of(Face::body, answer.label) + ui.px(36));
  const float row = std::max(widest * static_cast<float>(question.answers.size()), ui.px(430));
  if (!ui.begin_dialog(std::min(row + ui.px(2 * Ui::kDialogPadding), ui.window().width - ui.px(16)))) return;
  ui.text(Face::figure, theme::kText, question.title);
  ui.gap(12);
  ui.paragraph(Face::body, theme::kGray, question.sentence);
  ui.gap(22);
  std::optional<std::size_t> clicked;
  if (ui.begin_table("##answers", static_cast<int>(question.answers.size()), 12)) {
    for (std::size_t i = 0; i < question.answers.size(); ++i) {
      const Answer& answer = question.answers[i];
      ui.next_cell();
      if (draw_button(ui, answer.label, answer.key, answer.ink, ui.room().width, ui.px(54))) clicked = i;
    }
    ui.end_table();
  }
  ui.end_dialog();
  if (clicked) controls.answer(*clicked, now_s);
}

/// Draws all lines, in two columns if there is room; in a small window it scrolls.
void draw_help(Ui& ui, const Controls& controls) {
  std::vector<std::pair<std::string, std::string>> lines;
  for (const ActionRow& row : controls.rows())
    if (!row.help.empty()) lines.emplace_back(row.key, row.help);
  for (auto& line : controls.mouse_help()) lines.push_back(std::move(line));
  const Box window = ui.window();
  const std::size_t columns = window.width > ui.px(880) ? 2 : 1,
                    rows = (lines.size() + columns - 1) / columns;
  const float room = window.height - ui.px(2 * Ui::kDialogPadding) - ui.height_of(Face::figure) - ui.px(18);
  const float each = room / static_cast<float>(rows);
  const Face face = each >= ui.height_of(Face::body) + ui.px(2) ? Face::body : Face::small;
  const double gap = std::clamp<double>((each - ui.height_of(face)) / ui.px(1), 0, 11);
  const float width = ui.px(430 * static_cast<double>(columns) + 2 * Ui::kDialogPadding);
  if (!ui.begin_dialog(std::min(width, window.width))) return;
  ui.text(Face::figure, theme::kText, "Keys and mouse");
  ui.gap(18);
  const float height = static_cast<float>(rows) * (ui.height_of(face) + ui.px(gap));
  ui.begin_child("##room", std::min(height, room));
  if (ui.begin_table("##lines", static_cast<int>(2 * columns), 24, true)) {
    for (std::size_t i = 0; i < rows * columns; ++i) {
      const std::size_t line = i / columns + i % columns * rows;
      ui.next_cell();
      if (line < lines.size()) ui.text(face, theme::kBlue, lines[line].first, Cut::none);
      ui.gap(gap);
      ui.next_cell();
      if (line < lines.size()) ui.text(face, theme::kText, lines[line].second, Cut::none);
    }
    ui.end_table();
  }
  ui.end_child();
  ui.end_dialog();
}

}  // namespace

void draw_action_bar(Ui& ui, const Box& bar, Controls& controls, double now_s) {
  ui.begin_panel("##bar", bar, kBarMargin);
  ui.fill({bar.x, bar.y, bar.width, ui.px(1)}, theme::kLine);
  const std::vector<BarButton> buttons = buttons_that_fit(ui, controls, bar.width);
  std::optional<Action> clicked;
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    const auto& [row, look] = buttons[i];
    if (i > 0) ImGui::SameLine(0, ui.px(row->group == buttons[i - 1].row->group ? kButtonGap : kGroupGap));
    if (draw_button(ui, look.label, row->key, look.ink, button_width(ui, buttons[i]),
                    bar.height - ui.px(2 * kBarMargin)))
      clicked = row->action;
  }
  ui.end_panel();
  if (clicked) controls.perform(*clicked, now_s);
}

void draw_messages(Ui& ui, const Box& view, const Controls& controls) {
  float bottom = view.bottom() - ui.px(18);
  for (auto toast = controls.toasts().rbegin(); toast != controls.toasts().rend(); ++toast) {
    const Box box = ui.card(view.x + 0.5F * view.width, bottom, view.width - ui.px(48), 0,
                            {{Face::body, theme::kText, toast->text}}, 0.5F, 1);
    if (toast->trouble) ui.frame(box, theme::kRed, 10, 2);
    bottom = box.y - ui.px(6);
    if (bottom < view.y + ui.px(60)) return;
  }
}

void draw_dialogs(Ui& ui, Controls& controls, double now_s) {
  if (const std::optional<Question> question = controls.question())
    draw_question(ui, *question, controls, now_s);
  else if (controls.shows_help())
    draw_help(ui, controls);
}

}  // namespace gelslam::viewer
