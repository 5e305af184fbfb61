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

bool is_mesh(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".ply" || extension == ".obj" || extension == ".stl";
}

/// Nothing where it is neither a run nor a mesh, or cannot be looked at.
std::optional<Viewable> viewable(const fs::directory_entry& entry) {
  std::error_code code;
  const bool is_run = entry.is_directory(code) && fs::exists(entry.path() / "mesh.ply", code) &&
                      fs::exists(entry.path() / "report.json", code);
  if (!is_run && !(is_mesh(entry.path()) && entry.is_regular_file(code))) return std::nullopt;
  const fs::path dated = is_run ? entry.path() / "report.json" : entry.path();
  const fs::file_time_type changed = fs::last_write_time(dated, code);
  if (code) return std::nullopt;
  return Viewable{entry.path(), changed};
}

}  // namespace

std::vector<Viewable> find_viewable(const fs::path& folder) {
  std::vector<Viewable> found;
  std::error_code code;
  std::size_t seen = 0;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, code);
  for (const fs::recursive_directory_iterator end; !code && entry != end && ++seen < kMaxEntries;
       entry.increment(code)) {
    std::optional<Viewable> here = is_hidden(entry->path()) ? std::nullopt : viewable(*entry);
    if (here || is_hidden(entry->path()) || entry.depth() >= kMaxDepth) entry.disable_recursion_pending();
    if (here) found.push_back(std::move(*here));
  }
  std::sort(found.begin(), found.end(), [](const Viewable& a, const Viewable& b) {
    return a.changed != b.changed ? a.changed > b.changed : a.path < b.path;
  });
  return found;
}

std::optional<fs::path> run_choose_window(const fs::path& folder, const std::string& complaint,
                                          const viewer::WindowLoopOptions& options) {
  viewer::detail::ChooseWindow window(folder, complaint, options);
  window.run();
  return window.chosen();
}

}  // namespace gelslam

namespace gelslam::viewer::detail {
namespace {

constexpr double kMargin = 22, kRowHeight = 56, kRowGap = 6;  // design pixels

std::string date_of(std::filesystem::file_time_type changed) {
  const auto time = std::chrono::file_clock::to_sys(changed);
  const std::time_t seconds =
      std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::seconds>(time));
  return fmt::format("{:%Y-%m-%d %H:%M}", fmt::localtime(seconds));
}

}  // namespace

ChooseControls::ChooseControls()
    : Controls({{Action::step_back, "left", "Left", "Newer", 0, 0, "Newer ones"},
                {Action::step_on, "right", "Right", "Older", 0, 0, "Older ones"},
                common_row(Action::help),
                {Action::close, "q esc", "Q", "Close", 5, 0, "Close"}}) {}

void ChooseControls::act(Action action, double /*now_s*/) {
  if (action == Action::close) close();
  if (action == Action::step_back) --page_;
  if (action == Action::step_on) ++page_;
}

std::size_t ChooseControls::first(std::size_t rows, std::size_t all) {
  const int last = all == 0 ? 0 : static_cast<int>((all - 1) / rows);
  page_ = std::clamp(page_, 0, last);
  return static_cast<std::size_t>(page_) * rows;
}

ChooseWindow::ChooseWindow(const std::filesystem::path& folder, const std::string& complaint,
                           const WindowLoopOptions& options)
    : WindowLoop(options), folder_(folder), complaint_(complaint), found_(find_viewable(folder)) {}

void ChooseWindow::choose(const std::filesystem::path& path) {
  chosen_ = path;
  controls_.choose();
}

void ChooseWindow::draw_frame(Ui& ui, double now_s) {
  const Box window = ui.window();
  const float bar = ui.px(kBarHeight);
  ui.begin_panel("##choose", {0, 0, window.width, window.height - bar}, kMargin);
  ui.text(Face::figure, theme::kText, "Open a run or a mesh");
  ui.gap(8);
  ui.paragraph(Face::body, theme::kDim,
               found_.empty() ? "There is none below " + folder_.string() + ". Drop one on this window."
                              : "Below " + folder_.string() + ", or drop one on this window.");
  if (!complaint_.empty()) {
    ui.gap(8);
    ui.paragraph(Face::body, theme::kAmber, complaint_);
  }
  ui.gap(14);
  draw_rows(ui);
  ui.end_panel();
  draw_action_bar(ui, {0, window.height - bar, window.width, bar}, controls_, now_s);
  set_view(window);
}

void ChooseWindow::draw_rows(Ui& ui) {
  const Box room = ui.room();
  const float row = ui.px(kRowHeight + kRowGap);
  const auto rows = static_cast<std::size_t>(std::max(1.0F, room.height / row));
  const std::size_t first = controls_.first(rows, found_.size());
  for (std::size_t i = first; i < std::min(first + rows, found_.size()); ++i) {
    const std::string name = found_[i].path.lexically_relative(folder_).string();
    if (ui.button(ui.fitted(Face::body, name, room.width - ui.px(kMargin), Cut::start),
                  date_of(found_[i].changed), theme::kText, room.width, ui.px(kRowHeight)))
      choose(found_[i].path);
    ui.gap(kRowGap);
  }
}

}  // namespace gelslam::viewer::detail
