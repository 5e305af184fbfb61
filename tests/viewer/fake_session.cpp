#include "fake_session.hpp"

#include <cmath>

#include "gelslam/core/se3.hpp"

namespace gelslam::test {
namespace {

constexpr double kDepthMm = 0.9;
constexpr double kPlaceStepRad = 0.5;

Field object_field() { return bumpy_ellipsoid(7, {9, 8, 7}, 0.14); }

/// Distance from the origin to the object's surface along a direction.
double radius_along(const Field& field, const Eigen::Vector3d& direction) {
  double r = 8;
  for (int i = 0; i < 12; ++i) {
    const auto [value, gradient] = field(r * direction);
    r -= std::clamp(value / gradient.dot(direction), -0.5, 0.5);
  }
  return r;
}

/// The sensor pressed against the object from outside, along the surface's normal.
Pose pressed_from(const Field& field, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d point = radius_along(field, direction) * direction;
  const Eigen::Vector3d inward = -field(point).second.normalized();
  Pose pose = Pose::Identity();
  pose.linear() = rotation_of_z_to(inward);
  pose.translation() = point + kDepthMm * inward;
  return pose;
}

/// What a gel under three colored lamps would look like.
cv::Mat3b gel_picture(const Surface& surface) {
  cv::Mat3b picture(surface.normals.size());
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      const cv::Vec3f n = surface.normals(v, u);
      const float blue = -n[0], green = 0.5F * n[0] - 0.87F * n[1], red = 0.5F * n[0] + 0.87F * n[1];
      picture(v, u) = {cv::saturate_cast<uchar>(118 + 170 * blue),
                       cv::saturate_cast<uchar>(120 + 170 * green),
                       cv::saturate_cast<uchar>(112 + 170 * red)};
    }
  return picture;
}

Mesh make_object() {
  constexpr int rows = 100, columns = 200;
  const Field field = object_field();
  Mesh object;
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double polar = M_PI * row / rows, around = 2 * M_PI * column / columns;
      const Eigen::Vector3d direction(std::sin(polar) * std::cos(around), std::cos(polar),
                                      -std::sin(polar) * std::sin(around));
      const Eigen::Vector3d point = radius_along(field, direction) * direction;
      object.vertices_mm.push_back(point.cast<float>());
      object.normals.push_back(field(point).second.normalized().cast<float>());
      object.confidence.push_back(static_cast<float>(3 + 2 * std::sin(3 * around)));
    }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const int a = row * columns + column, b = row * columns + (column + 1) % columns;
      object.triangles.emplace_back(a, a + columns, b);
      object.triangles.emplace_back(b, a + columns, b + columns);
    }
  return object;
}

/// Made once: tracing rays takes longer than a test should.
const Mesh& fake_object() {
  static const Mesh object = make_object();
  return object;
}

const std::vector<FakePlace>& fake_places() {
  static const std::vector<FakePlace> places = [] {
    std::vector<FakePlace> made;
    const Field field = object_field();
    for (int i = 0; i < FakeSession::kMaxPlaces; ++i) {
      const double angle = kPlaceStepRad * i;
      const Eigen::Vector3d direction(std::sin(angle), 0.35 * std::sin(0.7 * angle), -std::cos(angle));
      const Pose pose = pressed_from(field, direction.normalized());
      made.push_back({pose, gelslam::test::touch(field, pose)});
    }
    return made;
  }();
  return places;
}

}  // namespace

FakeSession::FakeSession(int places, int frames_per_place)
    : frames_per_place_(frames_per_place), object_(fake_object()) {
  const auto& all = fake_places();
  places_.assign(all.begin(), all.begin() + places);
  for (std::size_t i = 0; i < object_.triangles.size(); ++i) {
    const Eigen::Vector3f p = object_.vertices_mm[static_cast<std::size_t>(object_.triangles[i].x())];
    const Eigen::Array3i cube = (p.array() / 4.0F + 100.0F).cast<int>();
    blocks_[(cube.x() * 1000 + cube.y()) * 1000 + cube.z()].push_back(static_cast<int>(i));
  }
  seen_.assign(object_.triangles.size(), false);
  status_.state = "keep the gel free";
  status_.source = "GelSight Mini R0B 28KX, /dev/video2, MJPG 3280x2464, 25 Hz";
}

void FakeSession::uncover(const Pose& object_T_sensor) {
  const Pose sensor_T_object = object_T_sensor.inverse(),
             map_T_object = places_.front().object_T_sensor.inverse();
  for (const auto& [key, triangles] : blocks_) {
    bool changed = false;
    for (const int i : triangles) {
      const auto index = static_cast<std::size_t>(i);
      const auto vertex = static_cast<std::size_t>(object_.triangles[index].x());
      const Eigen::Vector3d p = sensor_T_object * object_.vertices_mm[vertex].cast<double>();
      const Eigen::Vector3d n = sensor_T_object.linear() * object_.normals[vertex].cast<double>();
      if (seen_[index] || n.z() > -0.3 || std::pow(p.x() / 5.6, 2) + std::pow(p.y() / 4.6, 2) > 1) continue;
      seen_[index] = changed = true;
    }
    if (!changed) continue;
    MeshBlock block;
    block.key = key;
    std::map<int, int> used;
    const auto vertex = [&](int old) {
      const auto [place, is_new] = used.emplace(old, static_cast<int>(used.size()));
      if (is_new) {
        const auto from = static_cast<std::size_t>(old);
        block.mesh.vertices_mm.push_back(
            (map_T_object * object_.vertices_mm[from].cast<double>()).cast<float>());
        block.mesh.normals.push_back(
            (map_T_object.linear() * object_.normals[from].cast<double>()).cast<float>());
        block.mesh.confidence.push_back(object_.confidence[from]);
      }
      return place->second;
    };
    for (const int i : triangles) {
      if (!seen_[static_cast<std::size_t>(i)]) continue;
      const Eigen::Vector3i& t = object_.triangles[static_cast<std::size_t>(i)];
      const int a = vertex(t.x()), b = vertex(t.y()), c = vertex(t.z());
      block.mesh.triangles.emplace_back(a, b, c);
    }
    mesh_->add(false, {std::move(block)});
  }
}

void FakeSession::publish_map(int place) {
  auto map = std::make_shared<MapSnapshot>();
  map->version = ++version_;
  map->shown_component = 0;
  const Pose map_T_object = places_.front().object_T_sensor.inverse();
  for (int i = 0; i <= place; ++i) {
    const FakePlace& at = places_[static_cast<std::size_t>(i)];
    const Pose map_T_keyframe = map_T_object * at.object_T_sensor;
    map->nodes.push_back(
        {i, std::int64_t{i} * frames_per_place_, 0, 0, map_T_keyframe, at.surface, map_T_keyframe});
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
    auto touch = std::make_shared<LiveTouch>();
    touch->frame = frame_;
    touch->time_s = static_cast<double>(frame_) / 25;
    touch->image = gel_picture(*at.surface);
    touch->surface = at.surface;
    touch->status = TrackStatus::tracked;
    touch->keyframe = place;
    touch->trial = 0;
    touch->trial_T_frame = places_.front().object_T_sensor.inverse() * at.object_T_sensor;
    touch_ = std::move(touch);
    if (place >= status_.keyframes && !mapper_is_busy) {
      uncover(at.object_T_sensor);
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
  auto touch = std::make_shared<LiveTouch>(*touch_);
  auto surface = std::make_shared<Surface>(*touch_->surface);
  const cv::Size size = surface->contact.size();
  surface->contact = cv::Mat1b(size, uchar{0});  // new maps: the old ones are shared
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->height_mm = cv::Mat1f(size, 0.0F);
  surface->contact_pixels = 0;
  touch->image = gel_picture(*surface);
  touch->surface = surface;
  touch->status = TrackStatus::no_contact;
  touch->keyframe = -1;
  ++touch->frame;
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
