#include <algorithm>

#include "gelslam/viewer/controls.hpp"

namespace gelslam::viewer {
namespace {

constexpr double kBarMargin = 9, kButtonGap = 4, kGroupGap = 16;

struct BarButton {
  const ActionRow* row;
  ButtonLook look;
};

/// The buttons that fit, in the order of their groups.
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
      sum += ui.button_width(buttons[i].look.label, buttons[i].row->key);
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
  const auto wide = [&ui](const Answer& a) { return ui.width_of(Face::body, a.label) + ui.px(44); };
  float row = -ui.px(12);
  for (const Answer& answer : question.answers) row += wide(answer) + ui.px(12);
  const float most = ui.window().width - ui.px(16);
  const float width = std::min(std::max(row, ui.px(430)) + ui.px(2 * Ui::kDialogPadding), most);
  if (!ui.begin_dialog(width)) return;
  const float shrink = std::min(1.0F, ui.room().width / row);  // answers share a narrow row
  ui.text(Face::figure, theme::kText, question.title);
  ui.gap(12);
  ui.paragraph(Face::body, theme::kGray, question.sentence);
  ui.gap(22);
  std::optional<std::size_t> clicked;
  for (std::size_t i = 0; i < question.answers.size(); ++i) {
    const Answer& answer = question.answers[i];
    if (i > 0) ui.same_line(12 * static_cast<double>(shrink));
    if (ui.button(answer.label, answer.key, answer.ink, wide(answer) * shrink, ui.px(54))) clicked = i;
  }
  ui.end_dialog();
  if (clicked) controls.answer(*clicked, now_s);
}

/// All lines, in two columns where there is room; in a small window they move together.
void draw_help(Ui& ui, const Controls& controls) {
  std::vector<std::pair<std::string, std::string>> lines;
  for (const ActionRow& row : controls.rows())
    if (!row.help.empty()) lines.emplace_back(row.key, row.help);
  for (auto& line : controls.mouse_help()) lines.push_back(std::move(line));
  const Box window = ui.window();
  const std::size_t columns = window.width > ui.px(880) ? 2 : 1,
                    rows = (lines.size() + columns - 1) / columns;
  const float room = window.height - ui.px(2 * Ui::kDialogPadding) - ui.height_of(Face::figure) - ui.px(18);
  const float most = room / static_cast<float>(rows);
  const Face face = most >= ui.height_of(Face::body) + ui.px(2) ? Face::body : Face::small;
  const float row = std::min(ui.height_of(Face::body) + ui.px(11), most);
  const float column =
      std::min(ui.px(430), (window.width - ui.px(2 * Ui::kDialogPadding)) / static_cast<float>(columns));
  const float key_width = std::min(ui.px(120), 0.3F * column);
  if (!ui.begin_dialog(column * static_cast<float>(columns) + ui.px(2 * Ui::kDialogPadding))) return;
  ui.text(Face::figure, theme::kText, "Keys and mouse");
  ui.gap(18);
  const Box place = ui.room();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const float x = place.x + column * static_cast<float>(i / rows),
                y = place.y + row * static_cast<float>(i % rows);
    ui.text_at(face, x, y, theme::kBlue, lines[i].first);
    ui.text_at(face, x + key_width, y, theme::kText, lines[i].second);
  }
  ui.gap(static_cast<double>(row * static_cast<float>(rows) / ui.px(1)));
  ui.end_dialog();
}

}  // namespace

void draw_action_bar(Ui& ui, const Box& bar, Controls& controls, double now_s) {
  ui.begin_panel("##bar", bar, kBarMargin);
  ui.fill({bar.x, bar.y, bar.width, ui.px(1)}, theme::kLine);
  const std::vector<BarButton> buttons = buttons_that_fit(ui, controls, bar.width);
  std::optional<Action> clicked;
  for (std::size_t i = 0; i < buttons.size(); ++i) {
    if (i > 0) ui.same_line(buttons[i].row->group == buttons[i - 1].row->group ? kButtonGap : kGroupGap);
    if (ui.button(buttons[i].look.label, buttons[i].row->key, buttons[i].look.ink, 0,
                  bar.height - ui.px(2 * kBarMargin)))
      clicked = buttons[i].row->action;
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
  if (const std::optional<Question> question = controls.question()) {
    draw_question(ui, *question, controls, now_s);
  } else if (controls.shows_help()) {
    draw_help(ui, controls);
  }
}

}  // namespace gelslam::viewer
