#include "browse/view_window.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <system_error>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/status_text.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr std::size_t kOutlinePoints = 5000;
constexpr double kLongestPlayS = 20;
/// Position on the slider that counts as its end, because its very end is hard to hit.
constexpr double kRightEnd = 0.999;
constexpr double kSliderHeight = 46;  // design pixels

std::vector<ActionRow> view_rows(bool has_time) {
  using enum Action;
  std::vector<ActionRow> rows;
  if (has_time)
    rows = {{play, {GLFW_KEY_SPACE}, "Space", "Play", 0, 1, "Play, pause"},
            {step_back, {GLFW_KEY_LEFT}, "Left", "", 0, 0, "One keyframe back"},
            {step_on, {GLFW_KEY_RIGHT}, "Right", "", 0, 0, "One keyframe on"},
            common_row(trajectory),
            common_row(pose_graph),
            common_row(not_in_mesh)};
  for (const Action action : {curvature, next_color, show_all, screenshot, panels, help})
    rows.push_back(common_row(action));
  rows.push_back({close, {GLFW_KEY_Q, GLFW_KEY_ESCAPE}, "Q", "Close", 5, 0, "Close"});
  return rows;
}

std::vector<SceneColor> known_colors(bool has_second) {
  std::vector<SceneColor> known = {SceneColor::plain, SceneColor::confidence, SceneColor::height};
  if (has_second) known.push_back(SceneColor::distance);
  return known;
}

/// Returns the distances of the mesh's vertices.
std::vector<float> distances_mm(const Mesh& mesh, const TriangleScene& target) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : mesh.vertices_mm) points.push_back(p.cast<double>());
  std::vector<float> distances;
  for (const ClosestPoint& closest : target.closest(points))
    distances.push_back(static_cast<float>(closest.distance_mm));
  return distances;
}

/// Returns the distances as `evaluate` measures them; empty for a mesh without area.
std::vector<std::string> distance_notes(const Mesh& mesh, const TriangleScene& target) {
  try {
    const DistanceSummary distances = distances_from(mesh, target);
    return {fmt::format("mean {:.3f} mm", distances.mean_mm),
            fmt::format("90 % below {:.3f} mm", distances.p90_mm)};
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

ViewControls::ViewControls(const RunHistory* history, bool has_second, const SceneStyle& style,
                           std::optional<double> time_s)
    : SceneControls(view_rows(history != nullptr), style, known_colors(has_second)),
      history_(history),
      time_s_(history != nullptr ? time_s : std::nullopt) {}

void ViewControls::act(Action action, double now_s) {
  if (action == Action::play) return play_or_pause();
  if (action == Action::step_back) return step(-1);
  if (action == Action::step_on) return step(1);
  SceneControls::act(action, now_s);
}

ButtonLook ViewControls::button(const ActionRow& row) const {
  if (row.action == Action::play && plays_) return {true, "Pause", theme::kBlue};
  return SceneControls::button(row);
}

double ViewControls::share() const {
  if (!time_s_) return 1;
  const double length_s = history_->end_s() - history_->start_s();
  return length_s > 0 ? std::clamp((*time_s_ - history_->start_s()) / length_s, 0.0, 1.0) : 1;
}

void ViewControls::seek(double share) {
  plays_ = false;
  time_s_.reset();
  if (share < kRightEnd)
    time_s_ = history_->start_s() + std::max(share, 0.0) * (history_->end_s() - history_->start_s());
}

void ViewControls::step(int keyframes) {
  plays_ = false;
  const std::vector<double>& all_s = history_->keyframes_s;
  const double now_s = time_s_.value_or(history_->end_s());
  const std::ptrdiff_t newest = std::upper_bound(all_s.begin(), all_s.end(), now_s) - all_s.begin() - 1;
  // The run as saved comes after the last keyframe; going back from there, the last keyframe is the first
  // stop.
  const std::ptrdiff_t wanted = !time_s_ && keyframes < 0 ? newest : newest + keyframes;
  if (wanted >= std::ssize(all_s))
    time_s_.reset();
  else
    time_s_ = all_s[static_cast<std::size_t>(std::max<std::ptrdiff_t>(wanted, 0))];
}

void ViewControls::play_or_pause() {
  plays_ = !plays_;
  if (plays_ && !time_s_) time_s_ = history_->start_s();
}

bool ViewControls::advance(double dt_s) {
  if (!plays_ || !time_s_) return false;
  const double length_s = history_->end_s() - history_->start_s();
  *time_s_ += dt_s * std::max(1.0, length_s / kLongestPlayS);
  if (*time_s_ >= history_->end_s()) {
    time_s_.reset();
    plays_ = false;
  }
  return true;
}

ViewWindow::ViewWindow(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options)
    : SceneLoop(options),
      first_(std::move(first)),
      second_(std::move(second)),
      controls_(history(), second_.has_value(), options.style, options.time_s) {
  show_time();
  if (!second_) {
    first_scene_.set_mesh(first_.mesh);
    return;
  }
  second_scene_.emplace().set_mesh(second_->mesh);
  const TriangleScene target(second_->mesh);
  distance_notes_ = distance_notes(first_.mesh, target);
  first_scene_.set_mesh(first_.mesh, distances_mm(first_.mesh, target));
}

/// Shows the touch and the map at the time of the controls, or the saved state if there is none.
void ViewWindow::show_time() {
  shown_time_s_ = controls_.time_s();
  if (history() == nullptr) return;
  const double time_s = shown_time_s_.value_or(history()->end_s());
  first_scene_.set_map(history()->map_at(time_s));
  first_scene_.set_trajectory(history()->trajectory_at(time_s));
  const auto& all_s = history()->keyframes_s;
  const auto next = std::ranges::upper_bound(all_s, time_s);
  if (next == all_s.begin() || time_s >= history()->end_s()) return first_scene_.set_touch({});
  const MapSnapshot& session = history()->session;
  const MapSnapshot::Node& node = session.nodes[static_cast<std::size_t>(next - all_s.begin()) - 1];
  first_scene_.set_touch({node.surface.get(), session.gradient_scale.mean(), {{node.component_T_keyframe}}});
}

/// Returns a camera that sees everything from outside, facing most of the surface, with its long side
/// horizontal.
OrbitCamera ViewWindow::whole_view(const Viewport& viewport) const {
  std::vector<Eigen::Vector3f> outline;  // Points distributed over both meshes.
  const auto add = [&outline](const Mesh& mesh) {
    for (std::size_t i = 0; i < mesh.vertices_mm.size(); i += 1 + mesh.vertices_mm.size() / kOutlinePoints)
      outline.push_back(mesh.vertices_mm[i]);
  };
  add(first_.mesh);
  if (second_) add(second_->mesh);
  OrbitCamera camera;
  look_at_broad_side(first_.mesh, camera);
  return camera.fitted(outline, parts(viewport).front());
}

/// Side by side: the first one, then the second one.
std::vector<Viewport> ViewWindow::parts(const Viewport& whole) const {
  if (!second_) return {whole};
  const int left = whole.width / 2;
  return {{whole.x, whole.y, std::max(left, 1), whole.height},
          {whole.x + left, whole.y, std::max(whole.width - left, 1), whole.height}};
}

bool ViewWindow::advance(double /*now_s*/, double dt_s) {
  bool changed = controls_.advance(dt_s);
  if (shown_time_s_ != controls_.time_s()) {
    show_time();
    changed = true;
  }
  return move_camera(dt_s) || changed;
}

void ViewWindow::lay_out(const Ui& ui) {
  Box view = ui.window();
  bar_ = slider_ = track_ = {};
  if (controls_.shows_panels() && !is_snapshot_ && view.height >= ui.px(4 * kBarHeight)) {
    bar_ = view.cut_bottom(ui.px(kBarHeight));
    if (controls_.has_time()) {
      slider_ = view.cut_bottom(ui.px(kSliderHeight));
      track_ = {ui.px(22), slider_.y, view.width - ui.px(22 + 120), slider_.height};
    }
  }
  set_view(view);
}

void ViewWindow::draw_frame(Ui& ui, double now_s) {
  lay_out(ui);
  if (!std::exchange(camera_is_set_, true)) camera_ = whole_view(viewport());
  draw_scenes();
  if (controls_.shows_panels()) {
    draw_titles(ui);
    auto legend = first_scene_.legend(controls_.style());
    if (legend && controls_.style().color == SceneColor::distance) legend->notes = distance_notes_;
    draw_marks(ui, legend);
  }
  if (slider_.width > 0) draw_slider(ui);
  if (bar_.width > 0) draw_action_bar(ui, bar_, controls_, now_s);
}

/// Only the first one is colored by distance.
void ViewWindow::draw_scenes() {
  const std::vector<Viewport> shown = parts(viewport());
  SceneStyle style = controls_.style();
  if (history() != nullptr)
    show_not_in_mesh(first_scene_, history()->session, [this] { return first_.mesh; });
  first_scene_.draw(camera_, shown[0], style);
  if (!second_) return;
  if (const auto legend = first_scene_.legend(style)) style.range = {legend->min, legend->max};
  if (style.color == SceneColor::distance) style.color = SceneColor::plain;
  second_scene_->draw(camera_, shown[1], style);
}

void ViewWindow::draw_titles(Ui& ui) const {
  const std::vector<Viewport> all = parts(viewport());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Box part = box_of(all[i]);
    ui.text_at(
        Face::title, part.x + ui.px(18), part.y + ui.px(14), theme::kText,
        ui.fitted(Face::title, i == 0 ? first_.name : second_->name, part.width - ui.px(36), Cut::start));
    if (i > 0) ui.fill({part.x, part.y, ui.px(1), part.height}, theme::kLine);
  }
  const Box first = box_of(all.front());
  const float x = first.x + ui.px(18), width = first.width - ui.px(36);
  std::string warnings;
  for (const std::string& warning : first_.warnings)
    warnings += (warnings.empty() ? "" : " ") + sentences(warning);
  if (!warnings.empty())
    ui.card(x, first.y + ui.px(46), width, theme::kAmber, {{Face::body, theme::kText, warnings}});
}

void ViewWindow::draw_slider(Ui& ui) {
  const RunHistory& history = *this->history();
  const float middle = track_.y + 0.5F * ui.px(kSliderHeight),
              at = track_.x + static_cast<float>(controls_.share()) * track_.width;
  const double length_s = std::max(history.end_s() - history.start_s(), 1e-9);
  ui.begin_panel("##slider", slider_);
  for (const double time_s : history.keyframes_s) {
    const auto share = static_cast<float>((time_s - history.start_s()) / length_s);
    ui.fill({track_.x + share * track_.width, middle - ui.px(7), ui.px(1), ui.px(14)}, theme::kLine);
  }
  ui.fill({track_.x, middle - ui.px(2), track_.width, ui.px(4)}, theme::kRaised, 2);
  ui.fill({track_.x, middle - ui.px(2), at - track_.x, ui.px(4)}, theme::kBlue, 2);
  ui.disc(at, middle, ui.px(8), theme::kText);
  const auto time_s = controls_.time_s();
  ui.text_right(Face::body, slider_.right() - ui.px(16), middle - 0.5F * ui.height_of(Face::body),
                theme::kText, time_s ? fmt::format("{:.1f} s", *time_s - history.start_s()) : "as saved");
  if (const auto share = ui.held_share("##track", track_)) controls_.seek(*share);
  ui.end_panel();
}

cv::Mat3b ViewWindow::snapshot() {
  is_snapshot_ = true;
  return picture(0);
}

}  // namespace gelslam::viewer::detail

namespace gelslam {

void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options) {
  viewer::detail::ViewWindow(std::move(first), std::move(second), options).run();
}

void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png) {
  ViewWindowOptions hidden = options;
  hidden.visible = false;
  viewer::detail::ViewWindow window(std::move(first), std::move(second), hidden);
  viewer::write_png(png, window.snapshot());
}

namespace {

namespace fs = std::filesystem;

/// Reads the history; its times count from the start of the first log.
RunHistory read_history(RunFiles files) {
  RunHistory history{load_saved_map(files.folder), {}, std::move(files.trajectory)};
  for (StampedPose& pose : history.trajectory) pose.time_s -= files.start_s();
  for (const StampedPose& keyframe : files.keyframes)
    history.keyframes_s.push_back(keyframe.time_s - files.start_s());
  if (history.keyframes_s.size() != history.session.nodes.size())
    throw Error(files.folder.string() + ": keyframes.tum lists " +
                std::to_string(history.keyframes_s.size()) + " keyframes, session.db " +
                std::to_string(history.session.nodes.size()) + "; the folder holds files of two runs");
  return history;
}

ViewContent load_run(const fs::path& run) {
  RunFiles files = read_run_files(run);
  if (!fs::exists(run / "mesh.ply"))
    throw Error(run.string() + ": holds no mesh.ply; give a run folder or a mesh file");
  ViewContent content{name_of(run), read_mesh(run / "mesh.ply"), std::nullopt};
  if (files.report) content.warnings = files.report->result_warnings;
  if (fs::exists(run / "session.db")) content.history = read_history(std::move(files));
  return content;
}

void check_exists(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) throw Error(path.string() + ": no such file or folder");
}

}  // namespace

double RunHistory::start_s() const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  return std::min(trajectory.empty() ? kNever : trajectory.front().time_s,
                  keyframes_s.empty() ? kNever : keyframes_s.front());
}

double RunHistory::end_s() const {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  return std::max(trajectory.empty() ? kNever : trajectory.back().time_s,
                  keyframes_s.empty() ? kNever : keyframes_s.back());
}

MapSnapshot RunHistory::map_at(double time_s) const {
  MapSnapshot map = session;
  map.shown_component = 0;
  const auto later = std::ranges::upper_bound(keyframes_s, time_s);
  map.nodes.resize(static_cast<std::size_t>(later - keyframes_s.begin()));
  std::erase_if(map.edges, [&](const MapSnapshot::Edge& e) { return !map.find(e.from) || !map.find(e.to); });
  return map;
}

std::vector<std::vector<Pose>> RunHistory::trajectory_at(double time_s) const {
  const auto end = std::ranges::upper_bound(trajectory, time_s, {}, &StampedPose::time_s);
  return unbroken_segments({trajectory.begin(), end});
}

ViewContent load_view(const fs::path& run_or_mesh) {
  check_exists(run_or_mesh);
  if (fs::is_directory(run_or_mesh)) return load_run(run_or_mesh);
  return {name_of(run_or_mesh), read_mesh(run_or_mesh), std::nullopt};
}

ViewContent load_truth(const fs::path& data_folder_or_mesh, const fs::path& run) {
  check_exists(data_folder_or_mesh);
  if (!fs::is_directory(data_folder_or_mesh)) return load_view(data_folder_or_mesh);
  const Comparison comparison = compare(run, data_folder_or_mesh);
  const GroundTruth& truth = comparison.truth;
  if (truth.mesh_path.empty() || !truth.object_T_start) {
    throw Error(data_folder_or_mesh.string() +
                ": knows no true surface (gt_mesh.ply and its place in meta.json)");
  }
  const Pose object_T_map = *truth.object_T_start * comparison.start_T_map;
  return {"truth", transformed(read_mesh(truth.mesh_path), object_T_map.inverse()), std::nullopt};
}

}  // namespace gelslam
