#include "ui/scene_loop.hpp"

#include <GLFW/glfw3.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace gelslam::viewer::detail {
namespace {

constexpr double kDoubleClickS = 0.35;
constexpr float kDoubleClickPx = 6;
constexpr double kMargin = 18;  // design pixels

bool nearly_there(const OrbitCamera& a, const OrbitCamera& b) {
  const float near_mm = 1e-3F * b.distance_mm();
  return (a.center_mm() - b.center_mm()).norm() < near_mm &&
         std::abs(a.distance_mm() - b.distance_mm()) < near_mm &&
         (a.map_R_camera() - b.map_R_camera()).norm() < 1e-3F;
}

/// Returns the longest of 1, 2, 5, 10, ... mm that fits.
double round_length_mm(double room_mm) {
  const double decade = std::pow(10.0, std::floor(std::log10(room_mm)));
  for (const double digit : {5.0, 2.0})
    if (digit * decade <= room_mm) return digit * decade;
  return decade;
}

void draw_scale_bar(Ui& ui, const Box& view, double mm_per_px) {
  if (!(mm_per_px > 0) || !std::isfinite(mm_per_px)) return;
  const double length_mm = round_length_mm(mm_per_px * static_cast<double>(ui.px(140)));
  const auto width = static_cast<float>(length_mm / mm_per_px);
  const float x = view.x + ui.px(kMargin + 4), y = view.bottom() - ui.px(kMargin + 6), tick = ui.px(9),
              thick = ui.px(2);
  ui.fill({x, y, width, thick}, theme::kText);
  for (const float at : {x, x + width - thick}) ui.fill({at, y - tick + thick, thick, tick}, theme::kText);
  ui.text_at(Face::body, x + thick, y - tick - ui.height_of(Face::body), theme::kText,
             fmt::format("{:.3g} mm", length_mm));
}

/// Draws the title, the color bar with the values at its ends, and the notes below.
void draw_legend(Ui& ui, const Box& view, const ColorLegend& legend) {
  const float width = ui.px(16), height = std::min(ui.px(220), 0.45F * view.height);
  const float small = ui.height_of(Face::small), notes = static_cast<float>(legend.notes.size()) * small;
  const Box bar{view.right() - ui.px(kMargin) - width,
                view.bottom() - ui.px(kMargin + (legend.notes.empty() ? 14 : 24)) - notes - height, width,
                height};
  const auto steps = static_cast<float>(legend.colors_rgb.size());
  for (std::size_t i = 0; i < legend.colors_rgb.size(); ++i) {
    const auto& [r, g, b] = legend.colors_rgb[i];
    const float from_below = static_cast<float>(i + 1) / steps;
    ui.fill({bar.x, bar.y + (1 - from_below) * bar.height, bar.width, bar.height / steps + 1},
            theme::rgb(r, g, b));
  }
  const std::string unit = legend.unit.empty() ? "" : " " + legend.unit;
  const auto number = [&unit](float value) { return fmt::format("{:.3g}{}", value, unit); };
  const float right = bar.x - ui.px(8);
  ui.text_right(Face::small, right, bar.y, theme::kText, number(legend.max));
  ui.text_right(Face::small, right, bar.bottom() - small, theme::kText, number(legend.min));
  ui.text_right(Face::body, bar.right(), bar.y - ui.height_of(Face::body) - ui.px(6), theme::kText,
                legend.title);
  float y = bar.bottom() + ui.px(8);
  for (const std::string& note : legend.notes) {
    ui.text_right(Face::small, bar.right(), y, theme::kText, note);
    y += small;
  }
}

}  // namespace

bool SceneLoop::move_camera(double dt_s) {
  if (controls().take_show_all()) {
    show_all();
    controls().set_follows(false);
  }
  if (glide_ == Glide::none) return false;
  if (glide_ == Glide::all) goal_ = whole_view(viewport());
  if (!glide(goal_, dt_s)) glide_ = Glide::none;
  return true;
}

void SceneLoop::show_not_in_mesh(Scene& scene, const MapSnapshot& map, const std::function<Mesh()>& mesh) {
  const bool shown = controls().style().not_in_mesh;
  if (shown && !std::exchange(knows_not_in_mesh_, true)) {
    std::vector<TouchedSquare> squares;
    touched_surface(map, mesh(), 0, &squares);
    scene.set_unjoined(make_touch_mesh(squares));
  }
  scene.place_unjoined(shown ? std::optional(Pose::Identity()) : std::nullopt);
}

bool SceneLoop::glide(const OrbitCamera& goal, double dt_s) {
  if (nearly_there(camera_, goal)) return false;
  camera_.glide_to(goal, dt_s);
  return true;
}

bool SceneLoop::follow(const Pose& map_T_sensor, double dt_s) {
  const OrbitCamera before = camera_;
  camera_.follow(map_T_sensor, dt_s);
  return (before.eye_mm() - camera_.eye_mm()).norm() > 1e-3F * camera_.distance_mm() ||
         (before.map_R_camera() - camera_.map_R_camera()).norm() > 1e-3F;
}

std::optional<Eigen::Vector2f> SceneLoop::on_screen(const Viewport& part, const Eigen::Vector3f& p_mm) const {
  const Eigen::Matrix4f clip_T_camera = camera_.projection(part.aspect(), Eigen::AlignedBox3f(p_mm));
  const Eigen::Vector4f clip = clip_T_camera * camera_.camera_T_map() * p_mm.homogeneous();
  if (clip.w() <= 0) return std::nullopt;
  const Box box = box_of(part);
  return Eigen::Vector2f(box.x + 0.5F * (clip.x() / clip.w() + 1) * box.width,
                         box.y + 0.5F * (1 - clip.y() / clip.w()) * box.height);
}

Viewport SceneLoop::viewport() const {
  const int height = const_cast<SceneLoop*>(this)->host().viewport().height;
  return {static_cast<int>(view().x), height - static_cast<int>(view().bottom()),
          std::max(1, static_cast<int>(view().width)), std::max(1, static_cast<int>(view().height))};
}

Box SceneLoop::box_of(const Viewport& part) const {
  return {static_cast<float>(part.x), view().y, static_cast<float>(part.width),
          static_cast<float>(part.height)};
}

SceneLoop::Cursor SceneLoop::cursor_in_part(const Eigen::Vector2f& at_px) const {
  const std::vector<Viewport> all = parts(viewport());
  const std::size_t part = all.size() > 1 && at_px.x() >= static_cast<float>(all[1].x) ? 1 : 0;
  return {part, at_px - Eigen::Vector2f(static_cast<float>(all[part].x), view().y), all[part]};
}

void SceneLoop::pressed(int button, const Eigen::Vector2f& at_px, double now_s) {
  if (drag_button_) return;
  drag_button_ = button;
  last_px_ = at_px;
  if (button != GLFW_MOUSE_BUTTON_LEFT) return;
  const bool twice = now_s - pressed_s_ < kDoubleClickS && (at_px - pressed_px_).norm() < kDoubleClickPx;
  pressed_s_ = now_s;
  pressed_px_ = at_px;
  if (!twice) return;
  const Cursor cursor = cursor_in_part(at_px);
  if (const auto place = scene(cursor.part).pick(camera_.pick_ray(cursor.at_px, cursor.viewport))) {
    controls().set_follows(false);
    goal_ = camera_;
    goal_.look_at(*place);
    glide_ = Glide::place;
  }
}

void SceneLoop::moved(const Eigen::Vector2f& to_px) {
  const Eigen::Vector2f movement = to_px - last_px_;
  last_px_ = to_px;
  if (!drag_button_ || movement.isZero()) return;
  glide_ = Glide::none;
  controls().set_follows(false);
  if (*drag_button_ == GLFW_MOUSE_BUTTON_LEFT)
    camera_.orbit(movement, viewport());
  else
    camera_.pan(movement, viewport());
}

void SceneLoop::released(int button) {
  if (drag_button_ == button) drag_button_.reset();
}

void SceneLoop::scrolled(double steps, const Eigen::Vector2f& at_px) {
  glide_ = Glide::none;
  const Cursor cursor = cursor_in_part(at_px);
  camera_.zoom(steps, cursor.at_px, cursor.viewport);
}

void SceneLoop::draw_marks(Ui& ui, const std::optional<ColorLegend>& legend) const {
  const Viewport part = parts(viewport()).front();
  const Box first = box_of(part);
  draw_scale_bar(ui, first, static_cast<double>(camera_.mm_per_px(camera_.distance_mm(), part)));
  if (legend && first.height > ui.px(380)) draw_legend(ui, first, *legend);
}

}  // namespace gelslam::viewer::detail
