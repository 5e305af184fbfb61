#include "live/live_window.hpp"

#include <system_error>
#include <utility>

namespace gelslam::viewer::detail {
namespace {

/// Interval for values that are slower to query, such as disk space.
constexpr double kFiguresIntervalS = 0.5;
constexpr double kSideWidth = 298;  // design pixels
/// If the view would be smaller, it gets the whole window.
constexpr double kMinViewWidth = 480, kMinSideHeight = 420, kMinBarWidth = 300;

std::filesystem::path existing_parent(std::filesystem::path folder) {
  std::error_code code;
  folder = std::filesystem::absolute(folder, code);
  while (!std::filesystem::exists(folder, code) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

std::int64_t free_bytes(const std::filesystem::path& folder) {
  std::error_code code;
  const auto space = std::filesystem::space(existing_parent(folder), code);
  return code ? -1 : static_cast<std::int64_t>(space.available);
}

}  // namespace

Color color_of(Tone tone) {
  constexpr Color kColors[] = {theme::kGray, theme::kBlue, theme::kGreen, theme::kAmber, theme::kRed};
  return kColors[static_cast<int>(tone)];
}

LiveWindow::LiveWindow(LiveSession& session, const WindowOptions& options)
    : SceneLoop(options),
      session_(session),
      options_(options),
      controls_(session, options.keeps_run, options.next_run_folder) {}

bool LiveWindow::advance(double now_s, double dt_s) {
  const LivePhase phase_before = frame_.status.phase;
  look_at_figures(now_s);
  const LivePhase phase = frame_.status.phase;
  if (phase != phase_before && phase >= LivePhase::finishing) {
    controls_.set_follows(false);  // There is no touch any more, and the whole surface should be visible.
    show_all();
  }
  bool changed = poll_updates();
  changed |= move_camera(dt_s) || follow_touch(dt_s);
  return changed;
}

/// A surface shown beside the map must be visible together with it.
bool LiveWindow::follow_touch(double dt_s) {
  if (!controls_.follows()) return false;
  if (unjoined_preview_.is_shown()) {
    Eigen::AlignedBox3f both = scene_.bounds_mm();
    both.extend(unjoined_preview_.box_mm());
    return glide(camera_.fitted(both, viewport()), dt_s);
  }
  if (!map_T_touch_) return false;
  Pose seen = *map_T_touch_;  // Centers the touch in the area that the banner leaves free.
  const float up_mm = 0.5F * banner_px_ * camera_.mm_per_px(camera_.distance_mm(), viewport());
  seen.translation() += (up_mm * camera_.map_R_camera().col(1)).cast<double>();
  return follow(seen, dt_s);
}

void LiveWindow::look_at_figures(double now_s) {
  frame_.status = session_.status();
  frame_.words = state_words(frame_.status);
  if (unjoined_preview_.is_apart() && frame_.words.state == "lost")
    frame_.words.advice += " What you touch grows beside the map until then.";
  const std::filesystem::path folder = frame_.status.run_folder.empty()
                                           ? options_.picture_folder
                                           : std::filesystem::path(frame_.status.run_folder);
  set_picture_folder(folder);
  if (now_s - figures_s_ < kFiguresIntervalS) return;
  figures_s_ = now_s;
  frame_.disk_free_bytes = free_bytes(folder);
  frame_.output_folder = options_.keeps_run ? folder.string() : "";
}

Layout lay_out(const Ui& ui, bool shows_panels) {
  const Box window = ui.window();
  Layout boxes{window, {}, {}};
  if (!shows_panels) return boxes;
  const float bar = ui.px(kBarHeight), side = ui.px(kSideWidth);
  if (window.width >= ui.px(kMinBarWidth) && window.height >= 3 * bar) boxes.bar = boxes.view.cut_bottom(bar);
  if (window.width >= ui.px(kSideWidth + kMinViewWidth) && boxes.view.height >= ui.px(kMinSideHeight))
    boxes.side = boxes.view.cut_right(side);
  return boxes;
}

void LiveWindow::draw_frame(Ui& ui, double now_s) {
  const Layout boxes = lay_out(ui, controls_.shows_panels());
  set_view(boxes.view);
  side_ = boxes.side;
  SceneStyle style = controls_.style();
  // The finished scan shows only the surface.
  if (frame_.status.phase >= LivePhase::finishing) {
    style.touch = style.sensor = false;
    if (style.color == SceneColor::certainty) style.color = SceneColor::plain;
  }
  if (const auto mesh = session_.mesh(); mesh && frame_.status.phase == LivePhase::finished)
    show_not_in_mesh(scene_, *map_, [&mesh] { return mesh->whole(); });
  style.smooth_border = true;
  if (style.trajectory && trajectory_is_old_) rebuild_trajectory();
  scene_.draw(camera_, viewport(), style);
  frame_.mesh_mm = scene_.bounds_mm();
  if (controls_.shows_panels()) {
    draw_marks(ui, scene_.legend(style));
    const float bottom = draw_banner(ui, view(), frame_, now_s);
    banner_px_ = bottom - view().y;
    const Box below{view().x, bottom, view().width, view().bottom() - bottom};
    if (frame_.status.keyframes == 0 && frame_.status.phase < LivePhase::finishing)
      draw_start(ui, below, frame_);
    if (frame_.words.state == "finished") {
      const float covered_px = draw_end(ui, below, frame_);
      if (std::exchange(covered_px_, covered_px) != covered_px) show_all();
    }
    if (controls_.shows_diagnostics()) draw_diagnostics(ui, below, frame_);
  }
  if (side_.width > 0) draw_side(ui, side_, frame_);
  if (boxes.bar.width > 0) draw_action_bar(ui, boxes.bar, controls_, now_s);
}

/// A user who ends the scan from the terminal or logs out is not at the window; one who begins another scan
/// wants to see its window.
bool LiveWindow::closes_by_itself() {
  if (frame_.status.phase != LivePhase::finished) return false;
  const bool begins_another = controls_.wants_new_scan() && frame_.status.failure.empty();
  return begins_another || asks_to_end();
}

/// Uses the area that panels leave free, if it is at least half of the view.
OrbitCamera LiveWindow::whole_view(const Viewport& viewport) const {
  Viewport room = viewport;
  if (2 * covered_px_ <= static_cast<float>(viewport.width)) room.width -= cvRound(covered_px_);
  OrbitCamera camera = camera_.fitted(scene_.bounds_mm(), room);
  camera.pan({0.5F * static_cast<float>(viewport.width - room.width), 0}, viewport);
  return camera;
}

void LiveWindow::show_all_at_once() { camera_ = whole_view(viewport()); }

}  // namespace gelslam::viewer::detail

namespace gelslam {

bool run_live_window(LiveSession& session, const WindowOptions& options) {
  viewer::detail::LiveWindow window(session, options);
  // The panels know their size only in the second frame.
  for (int picture = 0; picture < 2; ++picture) window.turn(0, true);
  if (options.when_shown) options.when_shown();
  window.run();
  return window.controls().wants_new_scan();
}

void write_live_snapshot(LiveSession& session, const std::filesystem::path& png,
                         const WindowOptions& options) {
  WindowOptions without_display = options;
  without_display.visible = false;
  viewer::detail::LiveWindow window(session, without_display);
  window.turn(0, true);  // Takes the session's data and lays out the window.
  window.show_all_at_once();
  viewer::write_png(png, window.picture(0.01));
}

}  // namespace gelslam
