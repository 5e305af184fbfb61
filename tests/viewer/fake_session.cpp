#include "fake_session.hpp"

#include <cmath>

#include "../evaluation/test_meshes.hpp"
#include "gelslam/core/se3.hpp"

namespace gelslam::test {
namespace {

constexpr double kDepthMm = 0.9;
constexpr double kPlaceStepRad = 0.5;

const Field kPebble = bumpy_ellipsoid(7, {9, 8, 7}, 0.14);

/// Where the pebble's surface lies in a direction from its middle.
Eigen::Vector3d point_along(const Eigen::Vector3d& direction) {
  double r = 8;
  for (int i = 0; i < 12; ++i) {
    const auto [value, gradient] = kPebble(r * direction);
    r -= std::clamp(value / gradient.dot(direction), -0.5, 0.5);
  }
  return r * direction;
}

/// The sensor pressed against the pebble from outside, along the surface's normal.
Pose pressed_from(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d point = point_along(direction), inward = -kPebble(point).second.normalized();
  Pose pose = Pose::Identity();
  pose.linear() = rotation_of_z_to(inward);
  pose.translation() = point + kDepthMm * inward;
  return pose;
}

/// The map's frame is that of the first place.
Pose map_T_pebble() {
  static const Pose pebble_T_map = pressed_from(-Eigen::Vector3d::UnitZ());
  return pebble_T_map.inverse();
}

/// What a gel under three colored lamps would look like.
cv::Mat3b gel_picture(const Surface& surface) {
  cv::Mat picture;  // blue, green and red
  const cv::Matx34f lamps(-170, 0, 0, 118, 85, -148, 0, 120, 85, 148, 0, 112);
  cv::transform(surface.normals, picture, lamps);
  picture.convertTo(picture, CV_8U);
  return picture;
}

/// Made once: tracing rays takes longer than a test should.
const Mesh& pebble_mesh() {
  static const Mesh mesh = [] {
    Mesh made = sphere(1, 200);
    for (Eigen::Vector3f& p : made.vertices_mm) {
      made.confidence.push_back(3 + 2 * std::sin(3 * std::atan2(p.y(), p.x())));
      const Eigen::Vector3d point = point_along(p.cast<double>());
      p = (map_T_pebble() * point).cast<float>();
      made.normals.push_back((map_T_pebble().linear() * kPebble(point).second.normalized()).cast<float>());
    }
    return made;
  }();
  return mesh;
}

const std::vector<FakePlace>& fake_places() {
  static const std::vector<FakePlace> places = [] {
    std::vector<FakePlace> made;
    for (int i = 0; i < FakeSession::kMaxPlaces; ++i) {
      const double angle = kPlaceStepRad * i;
      const Eigen::Vector3d direction(std::sin(angle), 0.35 * std::sin(0.7 * angle), -std::cos(angle));
      const Pose pose = pressed_from(direction.normalized());
      made.push_back({map_T_pebble() * pose, touch(kPebble, pose)});
    }
    return made;
  }();
  return places;
}

}  // namespace

FakeSession::FakeSession(int places, int frames_per_place)
    : frames_per_place_(frames_per_place),
      places_(fake_places().begin(), fake_places().begin() + places),
      seen_(pebble_mesh().triangles.size(), false) {
  status_.state = "keep the gel free";
  status_.source = "GelSight Mini R0B 28KX, /dev/video2, MJPG 3280x2464, 25 Hz";
}

void FakeSession::uncover(int place) {
  const Mesh& mesh = pebble_mesh();
  const Pose sensor_T_map = places_[static_cast<std::size_t>(place)].map_T_sensor.inverse();
  std::vector<Eigen::Vector3i> new_ones;
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const auto corner = static_cast<std::size_t>(mesh.triangles[i].x());
    const Eigen::Vector3d p = sensor_T_map * mesh.vertices_mm[corner].cast<double>();
    const Eigen::Vector3d n = sensor_T_map.linear() * mesh.normals[corner].cast<double>();
    if (seen_[i] || n.z() > -0.3 || std::pow(p.x() / 5.6, 2) + std::pow(p.y() / 4.6, 2) > 1) continue;
    seen_[i] = true;
    new_ones.push_back(mesh.triangles[i]);
  }
  mesh_->add(false, {{place, submesh(mesh, new_ones), {}}});
}

void FakeSession::publish_map(int place) {
  auto map = std::make_shared<MapSnapshot>();
  map->version = ++version_;
  map->shown_component = 0;
  for (int i = 0; i <= place; ++i) {
    const FakePlace& at = places_[static_cast<std::size_t>(i)];
    map->nodes.push_back({i, std::int64_t{i} * frames_per_place_, 0, 0, at.map_T_sensor, at.surface});
    if (i > 0) map->edges.push_back({i - 1, i, EdgeKind::odometry, false});
    if (i > 2) map->edges.push_back({i - 3, i, EdgeKind::loop, i == 5});
  }
  status_.keyframes = place + 1;
  status_.loops = std::max(0, place - 2);
  map_ = std::move(map);
}

void FakeSession::advance(int frames) {
  for (int i = 0; i < frames; ++i) {
    const int place =
        static_cast<int>(frame_ / frames_per_place_ % static_cast<std::int64_t>(places_.size()));
    const FakePlace& at = places_[static_cast<std::size_t>(place)];
    auto touch = std::make_shared<FrameReport>();
    touch->tracked.frame = frame_;
    touch->tracked.time_s = static_cast<double>(frame_) / 25;
    touch->tracked.status = TrackStatus::tracked;
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = place;
    keyframe->frame = frame_;
    touch->tracked.keyframe = std::move(keyframe);
    touch->tracked.trial = 0;
    touch->image = gel_picture(*at.surface);
    touch->surface = at.surface;
    touch->in_map = MapPlace{{at.map_T_sensor}};
    touch_ = std::move(touch);
    if (place >= status_.keyframes && !mapper_is_busy) {
      uncover(place);
      publish_map(place);
    }
    ++frame_;
  }
  say(LivePhase::scanning, "tracking");
  status_.rate_hz = 25.0;
  status_.latency_ms = 17.6;
  status_.frames = frame_;
  status_.age_s = static_cast<double>(frame_) / 25;
  status_.trials = status_.components = 1;
  status_.memory_mb = 412;
  status_.log_bytes = frame_ * 620000;
}

void FakeSession::say(LivePhase phase, const std::string& state, TrackStatus track,
                      const std::string& reason) {
  status_.track = track;
  status_.phase = phase;
  status_.state = state;
  status_.reason = reason;
}

void FakeSession::release() {
  auto touch = std::make_shared<FrameReport>(*touch_);
  auto surface = std::make_shared<Surface>(*touch_->surface);
  const cv::Size size = surface->contact.size();
  surface->contact = cv::Mat1b(size, uchar{0});  // new maps: the old ones are shared
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->height_mm = cv::Mat1f(size, 0.0F);
  surface->contact_pixels = 0;
  touch->image = gel_picture(*surface);
  touch->surface = surface;
  touch->tracked.status = TrackStatus::no_contact;
  touch->tracked.keyframe = nullptr;
  touch->in_map.reset();
  ++touch->tracked.frame;
  touch_ = std::move(touch);
  say(LivePhase::scanning, "no contact", TrackStatus::no_contact);
}

void FakeSession::leave_the_map() {
  auto map = std::make_shared<MapSnapshot>(*map_);
  map->version = ++version_;
  map->nodes.back().component = map->nodes.back().keyframe;
  map_ = std::move(map);
  status_.components = 2;
}

void FakeSession::join_the_map() {
  auto map = std::make_shared<MapSnapshot>(*map_);
  map->version = ++version_;
  for (MapSnapshot::Node& node : map->nodes) node.component = map->shown_component;
  map_ = std::move(map);
  status_.components = 1;
}

LiveStatus FakeSession::status() const {
  if (status_.phase == LivePhase::finishing && looks_until_finished >= 0 && looks_++ >= looks_until_finished)
    status_.phase = LivePhase::finished;
  return status_;
}

void FakeSession::set_paused(bool paused) {
  calls.emplace_back(paused ? "pause" : "go on");
  if (paused)
    say(LivePhase::paused, "paused");
  else
    say(LivePhase::scanning, "tracking");
}

void FakeSession::stop() {
  calls.emplace_back("stop");
  say(LivePhase::finishing, "closing loops");
}

}  // namespace gelslam::test
