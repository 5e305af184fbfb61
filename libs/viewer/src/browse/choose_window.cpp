#include "browse/choose_window.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxDepth = 4;
constexpr std::size_t kMaxEntries = 20000;  ///< that are looked at: about a second on a cold disk

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool is_run(const fs::directory_entry& entry) {
  std::error_code code;
  return entry.is_directory(code) && fs::exists(entry.path() / "mesh.ply", code) &&
         fs::exists(entry.path() / "report.json", code);
}

bool is_mesh(const fs::directory_entry& entry) {
  std::error_code code;
  const std::string extension = entry.path().extension().string();
  return (extension == ".ply" || extension == ".obj" || extension == ".stl") && entry.is_regular_file(code);
}

bool is_log(const fs::directory_entry& entry) {
  std::error_code code;
  return (entry.path().extension() == ".mkv" || entry.path().filename() == "gelsight.avi") &&
         entry.is_regular_file(code);
}

/// What `wanted` says yes to and nothing within it, the newest first.
std::vector<Viewable> find_below(const fs::path& folder, bool (*wanted)(const fs::directory_entry&)) {
  std::vector<Viewable> found;
  std::error_code code;
  std::size_t seen = 0;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, code);
  for (const fs::recursive_directory_iterator end; !code && entry != end && ++seen < kMaxEntries;
       entry.increment(code)) {
    const bool here = !is_hidden(entry->path()) && wanted(*entry);
    if (here || is_hidden(entry->path()) || entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    if (!here) continue;
    std::error_code unreadable;
    const fs::path dated = is_run(*entry) ? entry->path() / "report.json" : entry->path();
    const fs::file_time_type changed = fs::last_write_time(dated, unreadable);
    if (!unreadable) found.push_back({entry->path(), changed});
  }
  std::sort(found.begin(), found.end(), [](const Viewable& a, const Viewable& b) {
    return a.changed != b.changed ? a.changed > b.changed : a.path < b.path;
  });
  return found;
}

std::string date_of(fs::file_time_type changed) {
  const auto time = std::chrono::file_clock::to_sys(changed);
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::seconds>(time));
  return fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(seconds));
}

std::vector<Choices::Choice> choices_of(const std::vector<Viewable>& found, const fs::path& folder) {
  std::vector<Choices::Choice> choices;
  for (const Viewable& each : found)
    choices.push_back({each.path.lexically_relative(folder).string(), date_of(each.changed), each.path});
  return choices;
}

}  // namespace

std::vector<Viewable> find_viewable(const fs::path& folder) {
  return find_below(folder, [](const fs::directory_entry& entry) { return is_run(entry) || is_mesh(entry); });
}

std::vector<Viewable> find_logs(const fs::path& folder) { return find_below(folder, is_log); }

Choices runs_and_meshes(const fs::path& folder) {
  Choices choices{"Open a run or a mesh", "", "", choices_of(find_viewable(folder), folder)};
  choices.sentence = choices.choices.empty()
                         ? "There is none below " + folder.string() + ". Drop one on this window."
                         : "Below " + folder.string() + ", or drop one on this window.";
  return choices;
}

Choices logs_to_replay(const fs::path& folder) {
  Choices choices{"Scan without a camera", "", "", choices_of(find_logs(folder), folder)};
  choices.sentence =
      choices.choices.empty()
          ? "There is no log below " + folder.string() + ". Drop one on this window."
          : "Logs below " + folder.string() + " play like a camera; or drop one on this window.";
  return choices;
}

std::optional<fs::path> run_choose_window(const Choices& choices, const viewer::WindowLoopOptions& options) {
  viewer::detail::ChooseWindow window(choices, options);
  window.run();
  return window.chosen();
}

}  // namespace gelslam

namespace gelslam::viewer::detail {
namespace {

constexpr double kMargin = 22, kRowHeight = 56, kRowGap = 6;  // design pixels

}  // namespace

ChooseControls::ChooseControls()
    : Controls({common_row(Action::help), {Action::close, "q esc", "Q", "Close", 5, 0, "Close"}}) {}

ChooseWindow::ChooseWindow(const Choices& choices, const WindowLoopOptions& options)
    : WindowLoop(options), choices_(choices) {}

void ChooseWindow::choose(const std::filesystem::path& path) {
  chosen_ = path;
  controls_.choose();
}

void ChooseWindow::draw_frame(Ui& ui, double now_s) {
  Box window = ui.window();
  set_view(window);
  const Box bar = window.cut_bottom(ui.px(kBarHeight));
  ui.begin_panel("##choose", window, kMargin);
  ui.text(Face::figure, theme::kText, choices_.title);
  ui.gap(8);
  ui.paragraph(Face::body, theme::kDim, choices_.sentence);
  if (!choices_.complaint.empty()) {
    ui.gap(8);
    ui.paragraph(Face::body, theme::kAmber, choices_.complaint);
  }
  ui.gap(14);
  ui.list("##list", choices_.choices.size(), [&](std::size_t i) {
    const Choices::Choice& each = choices_.choices[i];
    const float width = ui.room().width;
    if (ui.button(ui.fitted(Face::body, each.name, width - ui.px(kMargin), Cut::start), each.detail,
                  theme::kText, width, ui.px(kRowHeight)))
      choose(each.path);
    ui.gap(kRowGap);
  });
  ui.end_panel();
  draw_action_bar(ui, bar, controls_, now_s);
}

}  // namespace gelslam::viewer::detail
