#include "serve/scan_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "gelslam/slam/status_text.hpp"

namespace gelslam::exchange::detail {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTones[] = {"gray", "blue", "green", "amber", "red"};

const char* name_of(Tone tone) { return kTones[static_cast<int>(tone)]; }

double rounded(double number) { return std::round(1e3 * number) / 1e3; }

void append_point(Json& numbers, const Eigen::Vector3d& p) {
  for (const double coordinate : p) numbers.push_back(rounded(coordinate));
}

template <typename T>
void append(std::string& bytes, const std::vector<T>& numbers) {
  bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
}

/// Returns the trial and position of each placed keyframe.
Json path_of(const MapSnapshot& map) {
  Json points = Json::array();
  for (const MapSnapshot::Node& node : map.nodes) {
    if (!node.placed) continue;
    points.push_back(Json::array({node.trial}));
    append_point(points.back(), node.component_T_keyframe.translation());
  }
  return points;
}

std::int16_t share_of_largest(float number) {
  return static_cast<std::int16_t>(std::lround(32767 * std::clamp(number, -1.0F, 1.0F)));
}

void append_mesh(std::string& bytes, const Mesh& mesh) {
  constexpr float kMaxWeight = 128;
  std::vector<std::int16_t> normals(4 * mesh.vertices_mm.size());
  for (std::size_t i = 0; i < mesh.normals.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      normals[4 * i + k] = share_of_largest(mesh.normals[i][static_cast<int>(k)]);
  for (std::size_t i = 0; i < mesh.confidence.size(); ++i)
    normals[4 * i + 3] = share_of_largest(mesh.confidence[i] / kMaxWeight);
  append(bytes, mesh.vertices_mm);
  append(bytes, normals);
  append(bytes, mesh.triangles);
}

}  // namespace

Json status_json(const LiveStatus& s) {
  static constexpr const char* kPhases[] = {"background", "scanning", "paused", "finishing", "finished"};
  const StateWords words = state_words(s, false);
  Json json = {{"phase", kPhases[static_cast<int>(s.phase)]},
               {"state", words.state},
               {"tone", name_of(words.tone)},
               {"headline", words.headline},
               {"advice", words.advice},
               {"warnings", Json::array()},
               {"failure", s.failure},
               {"source", s.source},
               {"run_folder", s.run_folder},
               {"rate_hz", rounded(s.rate_hz)},
               {"latency_ms", rounded(s.latency_ms)},
               {"frames", s.frames},
               {"dropped", s.dropped},
               {"keyframes", s.keyframes},
               {"loops", s.loops},
               {"trials", s.trials},
               {"pieces", s.components},
               {"figures", Json::array()}};
  for (const std::string& warning : s.warnings) json["warnings"].push_back(sentences(warning));
  for (const auto& figures : {usual_figures(s), further_figures(s)})
    for (const Figure& figure : figures)
      json["figures"].push_back({figure.label, figure.value, name_of(figure.tone)});
  return json;
}

Json touch_json(const FrameReport& touch, const MapSnapshot* map) {
  if (!touch.surface || touch.surface->contact_pixels == 0) return nullptr;
  const Surface& surface = *touch.surface;
  std::optional<Pose> map_T_touch;
  if (touch.in_map && (map == nullptr || touch.in_map->component == map->shown_component))
    map_T_touch = touch.in_map->map_T_frame.pose;
  const double scale = map != nullptr ? map->gradient_scale.mean() : 1;
  const CameraModel camera = surface.camera();
  const cv::Size size = surface.contact.size();
  Json json = {{"picture", Json::array()}, {"map", Json::array()}, {"sensor", Json::array()}};
  std::vector<std::vector<cv::Point>> borders;
  cv::findContours(surface.contact, borders, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  for (const auto& border : borders) {
    std::vector<cv::Point> line;
    cv::approxPolyDP(border, line, 0.8, true);
    Json pixels = Json::array(), points = Json::array();
    for (const cv::Point& at : line) {
      pixels.push_back(rounded((at.x + 0.5) / size.width));
      pixels.push_back(rounded((at.y + 0.5) / size.height));
      if (map_T_touch)
        append_point(points,
                     *map_T_touch * camera.point_mm(at, static_cast<double>(surface.height_mm(at)) / scale));
    }
    json["picture"].push_back(std::move(pixels));
    if (map_T_touch) json["map"].push_back(std::move(points));
  }
  if (map_T_touch)
    for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
      append_point(
          json["sensor"],
          *map_T_touch * camera.point_mm(cv::Point(x * (size.width - 1), y * (size.height - 1)), 0.0));
  return json;
}

Json path_json(const MapSnapshot& map, const MapSnapshot* known) {
  Json points = path_of(map);
  const Json before = known != nullptr ? path_of(*known) : Json::array();
  const auto kept = std::ranges::mismatch(points, before).in1 - points.begin();
  points.erase(points.begin(), points.begin() + kept);
  return {{"kept", kept}, {"points", std::move(points)}};
}

std::string encode_changes(Json json, const MeshFeed::Changes& changes) {
  json["version"] = changes.version;
  json["newest"] = changes.newest;
  json["cleared"] = changes.cleared;
  json["blocks"] = Json::array();
  for (const MeshFeed::BlockPtr& block : changes.blocks)
    json["blocks"].push_back(
        {std::to_string(block->key), block->mesh.vertices_mm.size(), 3 * block->mesh.triangles.size()});
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto size = static_cast<std::uint32_t>(text.size());
  std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
  bytes += text;
  for (const MeshFeed::BlockPtr& block : changes.blocks) append_mesh(bytes, block->mesh);
  return bytes;
}

}  // namespace gelslam::exchange::detail
