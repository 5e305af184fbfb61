#include "locate/map_window.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr float kPicturesShare = 0.66F;  ///< Fraction of the side panel's height.
constexpr double kGhostOpacity = 0.75;   ///< Opacity of the most probable of several poses.
const Eigen::Vector3f kMapGray(0.30F, 0.31F, 0.33F);

std::vector<ActionRow> map_rows() {
  using enum Action;
  std::vector<ActionRow> rows;
  for (const Action action : {follow, curvature, show_all, screenshot, panels, help})
    rows.push_back(common_row(action));
  rows.push_back(
      {close, {GLFW_KEY_Q, GLFW_KEY_ESCAPE}, "Q", "Close", 5, 0, "Close; no more poses are written"});
  return rows;
}

/// Returns "0.020 mm, 0.11°": one standard deviation along the least certain axes.
std::string sigma_words(const PlaceHypothesis& place) {
  const Vector6d sigma = sigma_of(place.map_T_sensor.covariance);
  return fmt::format("{:.3f} mm, {:.2f}°", sigma.head<3>().maxCoeff(),
                     sigma.tail<3>().maxCoeff() * kDegreesPerRadian);
}

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

}  // namespace

StateWords place_words(const FrameReport* touch) {
  if (touch == nullptr || touch->tracked.status == TrackStatus::background)
    return {"background", Tone::blue, "Getting ready",
            "Keep the gel free until the map is read and the background is measured."};
  if (touch->tracked.status == TrackStatus::no_contact)
    return {"no_contact", Tone::gray, "No contact", "Press the sensor on the object."};
  const Localization& place = *touch->localization;
  const std::size_t count = place.hypotheses.size();
  if (place.status == PlaceStatus::localized)
    return {"localized", Tone::green, "Localized", "σ " + sigma_words(place.hypotheses.front())};
  if (place.status == PlaceStatus::ambiguous)
    return {"ambiguous", Tone::amber,
            count > 1 ? fmt::format("Ambiguous, {} places", count) : "Place uncertain",
            sentences(place.reason)};
  return {"not_in_map", Tone::red, "Not in the map", sentences(place.reason)};
}

MapWindow::MapWindow(const ShownMap& map, const LocatedTouches& touches, const WindowOptions& options)
    : SceneLoop(options),
      map_(map),
      touches_(touches),
      controls_(map_rows(), {.plain_rgb = kMapGray}, {SceneColor::plain}) {
  scene_.set_mesh(map.mesh);
  frame_.words = place_words(nullptr);
}

const std::vector<PlaceHypothesis>& MapWindow::places() const {
  static const std::vector<PlaceHypothesis> kNone;
  return touch_ && touch_->localization ? touch_->localization->hypotheses : kNone;
}

bool MapWindow::advance(double /*now_s*/, double dt_s) {
  const std::shared_ptr<const FrameReport> touch = touches_.newest;
  const bool is_new = touch != touch_;
  if (is_new) show(touch);
  if (touches_.have_ended) frame_.status.warnings = {"There are no more frames. Q closes."};
  return move_camera(dt_s) || follow_touch(dt_s) || is_new;
}

void MapWindow::show(const std::shared_ptr<const FrameReport>& touch) {
  touch_ = touch;
  frame_.words = place_words(touch.get());
  frame_.tactile.set(tactile_picture(touch->image, touch->surface.get()));
  if (touch->surface) frame_.normals.set(normal_picture(*touch->surface));
  TouchPatch patch{touch->surface, map_.gradient_scale};
  for (const PlaceHypothesis& place : places()) {
    const double opacity = touch->localization->status == PlaceStatus::localized
                               ? 1
                               : kGhostOpacity * place.probability / places().front().probability;
    patch.places.push_back({place.map_T_sensor.pose, opacity});
  }
  scene_.set_touch(std::move(patch));
}

/// Turns the touched side toward the viewer; if several poses are possible, the one that already faces the
/// viewer most. The whole map stays in view, unless the user has zoomed in.
bool MapWindow::follow_touch(double dt_s) {
  if (!controls_.follows() || !camera_is_set_ || places().empty()) return false;
  const Eigen::Vector3d looks = -camera_.map_R_camera().col(2).cast<double>();
  Pose goal = std::max_element(places().begin(), places().end(),
                               [&](const PlaceHypothesis& a, const PlaceHypothesis& b) {
                                 return a.map_T_sensor.pose.linear().col(2).dot(looks) <
                                        b.map_T_sensor.pose.linear().col(2).dot(looks);
                               })
                  ->map_T_sensor.pose;
  const Eigen::Vector3d middle = scene_.bounds_mm().center().cast<double>();
  const double nearness =
      1 - static_cast<double>(camera_.distance_mm() / whole_view(viewport()).distance_mm());
  goal.translation() = middle + std::clamp(nearness, 0.0, 1.0) * (goal.translation() - middle);
  return follow(goal, dt_s);
}

OrbitCamera MapWindow::whole_view(const Viewport& viewport) const {
  return camera_.fitted(scene_.bounds_mm(), viewport);
}

void MapWindow::draw_frame(Ui& ui, double now_s) {
  const Layout boxes = lay_out(ui, controls_.shows_panels());
  set_view(boxes.view);
  if (!std::exchange(camera_is_set_, true)) {
    look_at_broad_side(map_.mesh, camera_);
    camera_ = whole_view(viewport());
  }
  scene_.draw(camera_, viewport(), controls_.style());
  if (controls_.shows_panels()) {
    draw_probabilities(ui);
    draw_marks(ui, std::nullopt);
    draw_banner(ui, view(), frame_, now_s);
  }
  if (boxes.side.width > 0) draw_side(ui, boxes.side);
  if (boxes.bar.width > 0) draw_action_bar(ui, boxes.bar, controls_, now_s);
}

/// Draws the probability of each possible pose at the lower edge of the sensor's outline; dim behind the
/// object.
void MapWindow::draw_probabilities(Ui& ui) const {
  if (places().empty() || touch_->localization->status != PlaceStatus::ambiguous) return;
  for (const PlaceHypothesis& place : places()) {
    const double edge_mm = 0.5 * touch_->surface->contact.rows * touch_->surface->pixel_pitch_mm;
    const Eigen::Vector3f edge = (place.map_T_sensor.pose * Eigen::Vector3d(0, edge_mm, 0)).cast<float>();
    const auto at = on_screen(viewport(), edge);
    if (!at) continue;
    const Eigen::Vector3f outward = -place.map_T_sensor.pose.linear().col(2).cast<float>();
    const bool is_seen = outward.dot(camera_.eye_mm() - edge) > 0;
    ui.tag(Face::title, at->x(), at->y(), is_seen ? theme::kText : theme::kDim,
           theme::with_alpha(theme::kBackdrop, is_seen ? 0.7 : 0.4), percent(place.probability));
  }
}

void MapWindow::draw_side(Ui& ui, const Box& side) const {
  ui.begin_panel("##side", side, 14);
  ui.row(Face::small, map_.name, duration_text(touch_ ? touch_->tracked.time_s : 0));
  ui.gap(8);
  draw_pictures(ui, kPicturesShare * ui.room().height, frame_);
  ui.gap(12);
  ui.begin_child("##places");
  ui.text(Face::small, theme::kDim, "Places: one standard deviation, probability");
  ui.gap(8);
  double elsewhere = 1;
  const auto line = [&](const std::string& name, double share, Color color) {
    ui.row(Face::body, name, percent(share));
    ui.gap(2);
    ui.bar(share, color, 4);
    ui.gap(5);
  };
  for (const PlaceHypothesis& place : places()) {
    line(sigma_words(place), place.probability, color_of(frame_.words.tone));
    elsewhere -= place.probability;
  }
  line("elsewhere or not in the map", std::max(0.0, elsewhere), theme::kGray);
  ui.end_child();
  ui.end_panel();
}

}  // namespace gelslam::viewer::detail

namespace gelslam {

void run_map_window(const ShownMap& map, const LocatedTouches& touches, const WindowOptions& options) {
  viewer::detail::MapWindow(map, touches, options).run();
}

void write_map_snapshot(const ShownMap& map, const LocatedTouches& touches,
                        const std::filesystem::path& png) {
  LocatedTouches last;
  last.newest = touches.placed.load() ? touches.placed.load() : touches.newest.load();
  WindowOptions options;
  options.visible = false;
  viewer::detail::MapWindow window(map, last, options);
  window.turn(0, true);  // Lays out the window.
  window.turn_to_touch();
  viewer::write_png(png, window.picture(0.01));
}

}  // namespace gelslam
