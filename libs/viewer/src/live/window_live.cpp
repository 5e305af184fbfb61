#include "live/window_live.hpp"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <chrono>
#include <system_error>

#include "gelslam/core/error.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double frame_s = 1.0 / 60;
constexpr double figures_interval_s = 0.5;  ///< of what costs more than a glance: stage times, disk
constexpr double idle_redraw_s = 0.5;
constexpr double double_click_s = 0.35;
constexpr float double_click_px = 6;

WindowHostOptions host_options(const WindowOptions& options) {
  return {options.title, options.width_px, options.height_px, options.visible};
}

std::filesystem::path existing_parent(std::filesystem::path folder) {
  std::error_code code;
  folder = std::filesystem::absolute(folder, code);
  while (!std::filesystem::exists(folder, code) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

double free_bytes(const std::filesystem::path& folder) {
  std::error_code code;
  const auto space = std::filesystem::space(existing_parent(folder), code);
  return code ? -1 : static_cast<double>(space.available);
}

/// Meshes are what most people look for, screenshots what they know already.
int rank(const std::string& name) { return name.starts_with("mesh") ? 0 : name.ends_with(".png") ? 2 : 1; }

/// What lies in the finished run's folder; folders in it with a stroke and no size.
std::vector<ResultFile> files_in(const std::filesystem::path& folder) {
  std::vector<ResultFile> files;
  std::error_code code;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    std::error_code ignored;
    const bool is_folder = it->is_directory(ignored);
    const double bytes = is_folder ? -1 : static_cast<double>(it->file_size(ignored));
    files.push_back({it->path().filename().string() + (is_folder ? "/" : ""), bytes});
  }
  std::sort(files.begin(), files.end(), [](const ResultFile& a, const ResultFile& b) {
    return std::pair(rank(a.name), a.name) < std::pair(rank(b.name), b.name);
  });
  return files;
}

}  // namespace

LiveWindow::LiveWindow(LiveSession& session, const WindowOptions& options)
    : session_(session),
      options_(options),
      host_(host_options(options)),
      controls_(session, options.keeps_run),
      player_(parse_script(options.script, options.script_name), options.script_name) {
  const ImVec4 outline = ImGui::ColorConvertU32ToFloat4(theme::green);
  const auto byte = [](float share) { return cv::saturate_cast<uchar>(255 * share); };
  view_.set_outline({byte(outline.z), byte(outline.y), byte(outline.x)});
}

void LiveWindow::run() {
  const WindowClock clock;
  while (!wants_to_close()) {
    const double begin_s = clock.now_s();
    const bool drew = turn(begin_s);
    const double took_s = clock.now_s() - begin_s;
    // Without a graphics card a picture takes long; then at least half of the time belongs to the scan.
    host_.wait(drew ? std::max(frame_s - took_s, std::min(took_s, 0.1)) : frame_s);
  }
  if (!options_.snapshot.empty()) write_png(options_.snapshot.string(), picture(clock.now_s()));
}

bool LiveWindow::turn(double now_s, bool draw_anyway) {
  const bool scripted = !player_.done();
  if (scripted) player_.play({live_state(session_.status()), layout_.view, &texts_}, host_, now_s);
  const double dt_s = std::clamp(now_s - drawn_s_, 1e-3, 0.1);
  const Dialog dialog_before = controls_.dialog();
  const std::size_t toasts_before = controls_.toasts().size();
  const LivePhase phase_before = status_.phase;
  handle_input(now_s);
  controls_.drop_old_toasts(now_s);
  look_at_figures(now_s);
  if (status_.phase != phase_before && status_.phase >= LivePhase::finishing) {
    controls_.stop_following();  // there is no touch any more; all of the surface is to be seen
    view_.show_all();
  }
  bool changed = view_.take_news(session_, now_s) || draw_anyway || scripted || input_seen_;
  changed |= controls_.take_reset_view() && (view_.show_all(), true);
  changed |= view_.advance(dt_s, controls_.follows(), view_viewport());
  changed |= controls_.dialog() != dialog_before || controls_.toasts().size() != toasts_before;
  if (!changed && now_s - drawn_s_ < idle_redraw_s) return false;
  draw(now_s);
  drawn_s_ = now_s;
  return true;
}

void LiveWindow::look_at_figures(double now_s) {
  status_ = session_.status();
  if (now_s - figures_s_ < figures_interval_s) return;
  figures_s_ = now_s;
  stages_ = session_.stage_times();
  disk_free_bytes_ = free_bytes(options_.output_folder);
  if (status_.phase == LivePhase::finished && options_.keeps_run) results_ = files_in(options_.output_folder);
}

LiveFrame LiveWindow::gather(double now_s) const {
  LiveFrame frame;
  frame.status = status_;
  frame.words = state_words(status_);
  if (frame.words.state == LiveState::finished && !options_.keeps_run)
    frame.words.advice = "Nothing is kept (no -o). E exports the mesh; Q closes.";
  frame.stages = stages_;
  frame.output_folder = options_.keeps_run ? options_.output_folder.string() : "";
  frame.disk_free_bytes = disk_free_bytes_;
  frame.results = results_;
  frame.triangles = view_.mesh().triangles();
  frame.tactile = &view_.tactile();
  frame.normals = &view_.normals();
  frame.legend = view_.legend(controls_.style());
  frame.mm_per_px = view_.mm_per_px(view_viewport());
  frame.time_s = now_s;
  return frame;
}

void LiveWindow::draw(double now_s) {
  host_.begin_frame(std::max(1e-3, now_s - drawn_s_));
  const Viewport window = host_.viewport();
  {
    Canvas canvas(host_.ui_scale());
    layout_ = lay_out(canvas, static_cast<float>(window.width), static_cast<float>(window.height),
                      controls_.shows_panels());
    view_.draw(view_viewport(), style_now());
    draw_panels(canvas, layout_, gather(now_s), controls_);
    texts_ = canvas.take_texts();
    panels_ = canvas.take_panels();
  }
  host_.end_frame();
  fulfil_wishes(now_s);
  host_.present();
}

SceneStyle LiveWindow::style_now() const {
  SceneStyle style = controls_.style();
  // What is to be looked at in the end is the surface alone.
  if (status_.phase >= LivePhase::finishing) style.touch = style.sensor = false;
  return style;
}

void LiveWindow::fulfil_wishes(double now_s) {
  if (controls_.take_screenshot()) tell(save_picture(host_, options_.output_folder, "screenshot"), now_s);
  player_.write_screenshot(host_, options_.output_folder);
  if (const auto format = controls_.take_export()) {
    if (export_.valid()) {
      controls_.complain("The last export is still being written.", now_s);
    } else {
      export_ =
          export_in_background(view_.mesh().blocks(), free_name(options_.output_folder, "mesh_mm", *format));
    }
  }
  if (export_.valid() && export_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    tell(export_.get(), now_s);
  }
}

/// Who ends a scan from the terminal, or logs out, is not at the window.
bool LiveWindow::closes_by_itself() const {
  return status_.phase == LivePhase::finished && options_.asks_to_end && options_.asks_to_end();
}

void LiveWindow::tell(const ExportOutcome& outcome, double now_s) {
  outcome.ok ? controls_.say(outcome.sentence, now_s) : controls_.complain(outcome.sentence, now_s);
}

cv::Mat3b LiveWindow::picture(double now_s) {
  host_.want_picture();
  turn(now_s, true);
  return host_.take_picture();
}

void LiveWindow::show_all_at_once() { view_.show_all_at_once(view_viewport()); }

Viewport LiveWindow::view_viewport() const {
  const Box& view = layout_.view;
  const auto whole = host_.viewport();
  return {0, whole.height - static_cast<int>(view.height), std::max(1, static_cast<int>(view.width)),
          std::max(1, static_cast<int>(view.height))};
}

bool LiveWindow::on_panel(double x, double y) const {
  return controls_.dialog() != Dialog::none ||
         std::any_of(panels_.begin(), panels_.end(),
                     [x, y](const Box& panel) { return panel.contains(x, y); });
}

void LiveWindow::handle_input(double now_s) {
  const std::vector<InputEvent> events = host_.take_input();
  input_seen_ = !events.empty();
  for (const InputEvent& event : events) {
    switch (event.kind) {
      case InputEvent::Kind::key:
        if (event.pressed) controls_.press_key(event.code, now_s);
        break;
      case InputEvent::Kind::close:
        controls_.ask_to_close();
        break;
      case InputEvent::Kind::pointer:
        handle_pointer(event);
        break;
      case InputEvent::Kind::button:
        handle_button(event, now_s);
        break;
      case InputEvent::Kind::scroll:
        if (!on_panel(pointer_px_.x(), pointer_px_.y())) view_.zoom(event.y, pointer_px_, view_viewport());
        break;
    }
  }
}

void LiveWindow::handle_pointer(const InputEvent& event) {
  pointer_px_ = Eigen::Vector2d(event.x, event.y).cast<float>();
  if (!drag_) return;
  const Eigen::Vector2f movement = pointer_px_ - drag_->last_px;
  drag_->last_px = pointer_px_;
  if (movement.isZero()) return;
  controls_.stop_following();
  view_.drag(drag_->button, movement, view_viewport());
}

void LiveWindow::handle_button(const InputEvent& event, double now_s) {
  if (!event.pressed) {
    if (drag_ && drag_->button == event.code) drag_.reset();
    return;
  }
  if (drag_ || on_panel(pointer_px_.x(), pointer_px_.y())) return;
  drag_ = Drag{event.code, pointer_px_};
  if (event.code != GLFW_MOUSE_BUTTON_LEFT) return;
  if (now_s - pressed_s_ < double_click_s && (pointer_px_ - pressed_px_).norm() < double_click_px) {
    controls_.stop_following();
    view_.center_on(pointer_px_, view_viewport());
  }
  pressed_s_ = now_s;
  pressed_px_ = pointer_px_;
}

}  // namespace gelslam::viewer::detail
