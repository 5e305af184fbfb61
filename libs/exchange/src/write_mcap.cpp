#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <unordered_map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/config.hpp"
#include "mcap_file.hpp"

namespace gelslam {
namespace {

using exchange::detail::McapFile;
using Json = nlohmann::ordered_json;

/// A Unix time as a double is accurate to microseconds only.
std::uint64_t nanoseconds(double time_s) {
  constexpr double kUnixS = 1e8;
  const std::int64_t time_ns =
      time_s < kUnixS ? std::llround(std::max(time_s, 0.0) * 1e9) : 1000 * std::llround(time_s * 1e6);
  return static_cast<std::uint64_t>(time_ns);
}

Json stamp(double time_s) {
  const std::uint64_t time_ns = nanoseconds(time_s);
  return {{"sec", time_ns / 1'000'000'000}, {"nsec", time_ns % 1'000'000'000}};
}

// JSON schemas of Foxglove's messages, as far as they are used. Foxglove recognizes the types by their names.

Json object_schema(const char* title, Json properties) {
  Json required = Json::array();
  for (const auto& [name, schema] : properties.items()) required.push_back(name);
  return {
      {"title", title}, {"type", "object"}, {"properties", std::move(properties)}, {"required", required}};
}

Json array_schema(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }
Json simple_schema(const char* type) { return {{"type", type}}; }

Json numbers_schema(const char* title, const std::string& letters) {
  Json properties;
  for (const char letter : letters) properties[std::string(1, letter)] = simple_schema("number");
  return object_schema(title, properties);
}

Json time_schema(const char* title) {
  return object_schema(title, {{"sec", simple_schema("integer")}, {"nsec", simple_schema("integer")}});
}

Json pose_schema() {
  return object_schema("foxglove.Pose", {{"position", numbers_schema("foxglove.Vector3", "xyz")},
                                         {"orientation", numbers_schema("foxglove.Quaternion", "xyzw")}});
}

Json message_schema(const std::string& name) {
  Json properties{{"timestamp", time_schema("time")}};
  if (name == "foxglove.FrameTransform") {
    properties["parent_frame_id"] = properties["child_frame_id"] = simple_schema("string");
    properties["translation"] = numbers_schema("foxglove.Vector3", "xyz");
    properties["rotation"] = numbers_schema("foxglove.Quaternion", "xyzw");
    return object_schema(name.c_str(), properties);
  }
  properties["frame_id"] = simple_schema("string");
  if (name == "foxglove.PoseInFrame") {
    properties["pose"] = pose_schema();
    properties["covariance"] = array_schema(simple_schema("number"));  // Not part of Foxglove's schema.
  }
  if (name == "foxglove.PosesInFrame") properties["poses"] = array_schema(pose_schema());
  if (name == "foxglove.CompressedImage") {
    properties["data"] = {{"type", "string"}, {"contentEncoding", "base64"}};
    properties["format"] = simple_schema("string");
  }
  return object_schema(name.c_str(), properties);
}

Json scene_schema() {
  const Json points = array_schema(numbers_schema("foxglove.Point3", "xyz")),
             color = numbers_schema("foxglove.Color", "rgba");
  const Json triangles =
      object_schema("foxglove.TriangleListPrimitive", {{"pose", pose_schema()},
                                                       {"points", points},
                                                       {"color", color},
                                                       {"colors", array_schema(color)},
                                                       {"indices", array_schema(simple_schema("integer"))}});
  const Json lines =
      object_schema("foxglove.LinePrimitive", {{"type", simple_schema("integer")},
                                               {"pose", pose_schema()},
                                               {"thickness", simple_schema("number")},
                                               {"scale_invariant", simple_schema("boolean")},
                                               {"points", points},
                                               {"color", color},
                                               {"colors", array_schema(color)},
                                               {"indices", array_schema(simple_schema("integer"))}});
  const Json entity = object_schema("foxglove.SceneEntity", {{"timestamp", time_schema("time")},
                                                             {"frame_id", simple_schema("string")},
                                                             {"id", simple_schema("string")},
                                                             {"lifetime", time_schema("duration")},
                                                             {"frame_locked", simple_schema("boolean")},
                                                             {"lines", array_schema(lines)},
                                                             {"triangles", array_schema(triangles)}});
  return object_schema("foxglove.SceneUpdate", {{"entities", array_schema(entity)}});
}

// Messages.

Json xyz(const Eigen::Vector3d& v_mm) {
  return {{"x", meters(v_mm.x())}, {"y", meters(v_mm.y())}, {"z", meters(v_mm.z())}};
}

Json quaternion(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}

Json pose_message(const Pose& pose) {
  return {{"position", xyz(pose.translation())}, {"orientation", quaternion(pose)}};
}

Json poses_message(const std::vector<StampedPose>& poses, double time_s) {
  Json list = Json::array();
  for (const StampedPose& pose : poses) list.push_back(pose_message(pose.map_T_sensor));
  return {{"timestamp", stamp(time_s)}, {"frame_id", "map"}, {"poses", list}};
}

Json rgba(const std::array<std::uint8_t, 3>& color) {
  const auto share = [&](std::size_t i) { return std::round(color[i] / 255.0 * 1000) / 1000; };
  return {{"r", share(0)}, {"g", share(1)}, {"b", share(2)}, {"a", 1.0}};
}

constexpr std::size_t kTrianglesInAMessage = 5000;  // A vertex takes 0.7 kB of memory while it is written.

/// Returns a message with some of the mesh's triangles and their vertices.
Json triangles_message(const Mesh& mesh, const VertexColors& vertex_colors,
                       std::span<const Eigen::Vector3i> triangles) {
  Json points = Json::array(), colors = Json::array(), indices = Json::array();
  std::unordered_map<int, std::size_t> index_of;
  for (const Eigen::Vector3i& triangle : triangles)
    for (const int corner : triangle) {
      const auto [place, is_new] = index_of.try_emplace(corner, index_of.size());
      indices.push_back(place->second);
      if (!is_new) continue;
      const auto vertex = static_cast<std::size_t>(corner);
      points.push_back(xyz(mesh.vertices_mm[vertex].cast<double>()));
      if (!vertex_colors.empty()) colors.push_back(rgba(vertex_colors[vertex]));
    }
  return {{"pose", pose_message(Pose::Identity())},
          {"points", points},
          {"color", rgba({204, 196, 184})},
          {"colors", colors},
          {"indices", indices}};
}

Json lines_message(const std::vector<StampedPose>& trajectory) {
  Json lines = Json::array();
  for (const auto& segment : unbroken_segments(trajectory)) {
    Json points = Json::array();
    for (const Pose& pose : segment) points.push_back(xyz(pose.translation()));
    lines.push_back({{"type", 0},  // Type 0 is a line strip.
                     {"pose", pose_message(Pose::Identity())},
                     {"thickness", 2.0},
                     {"scale_invariant", true},  // The thickness is in pixels.
                     {"points", points},
                     {"color", rgba({230, 120, 20})},
                     {"colors", Json::array()},
                     {"indices", Json::array()}});
  }
  return lines;
}

Json scene_message(const std::string& id, double time_s, const char* kind, Json primitives) {
  Json entity{{"timestamp", stamp(time_s)},
              {"frame_id", "map"},
              {"id", id},
              {"lifetime", {{"sec", 0}, {"nsec", 0}}},
              {"frame_locked", true},
              {"metadata", Json::array()}};
  for (const char* name :
       {"arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"})
    entity[name] = Json::array();
  entity[kind] = std::move(primitives);
  return {{"deletions", Json::array()}, {"entities", Json::array({entity})}};
}

/// Writes a run into the file: small messages first or in between, images as they come from the log.
class RunRecorder {
 public:
  RunRecorder(const std::filesystem::path& path, const RunContents& run) : file_(path), run_(run) {
    for (const char* topic : {"/sensor", "/keyframe"}) add(topic, "foxglove.PoseInFrame");
    for (const char* topic : {"/trajectory", "/keyframes"}) add(topic, "foxglove.PosesInFrame");
    add("/tf", "foxglove.FrameTransform");
    add("/tactile", "foxglove.CompressedImage");
    channels_["/surface"] = file_.add_channel("/surface", "foxglove.SceneUpdate", scene_schema().dump());
    channels_["/path"] = file_.add_channel("/path", "foxglove.SceneUpdate", "");
  }

  /// Writes messages that hold for the whole run at its first time, so that they exist wherever playback
  /// starts.
  void write_whole(const VertexColors& colors) {
    const std::span<const Eigen::Vector3i> triangles = run_.mesh.triangles;
    const double start_s = run_.start_s();
    for (std::size_t first = 0; first < triangles.size(); first += kTrianglesInAMessage) {
      const auto part = triangles.subspan(first, std::min(kTrianglesInAMessage, triangles.size() - first));
      write("/surface", start_s,
            scene_message("surface " + std::to_string(first / kTrianglesInAMessage), start_s, "triangles",
                          Json::array({triangles_message(run_.mesh, colors, part)})));
    }
    write("/path", start_s, scene_message("path", start_s, "lines", lines_message(run_.trajectory)));
    write("/trajectory", start_s, poses_message(run_.trajectory, start_s));
    write("/keyframes", start_s, poses_message(run_.keyframes, start_s));
  }

  /// Writes the poses up to a time.
  void write_poses(double until_s) {
    for (; pose_ < run_.trajectory.size() && run_.trajectory[pose_].time_s <= until_s; ++pose_) {
      const StampedPose& p = run_.trajectory[pose_];
      write_pose("/sensor", p);
      write("/tf", p.time_s,
            {{"timestamp", stamp(p.time_s)},
             {"parent_frame_id", "map"},
             {"child_frame_id", "sensor"},
             {"translation", xyz(p.map_T_sensor.translation())},
             {"rotation", quaternion(p.map_T_sensor)}});
    }
    for (; keyframe_ < run_.keyframes.size() && run_.keyframes[keyframe_].time_s <= until_s; ++keyframe_)
      write_pose("/keyframe", run_.keyframes[keyframe_]);
  }

  void write_picture(const TactileImage& image) {
    write_poses(image.time_s);
    const std::vector<std::uint8_t> jpeg = encode_jpeg(image.bgr);
    write("/tactile", image.time_s,
          {{"timestamp", stamp(image.time_s)},
           {"frame_id", "sensor"},
           {"data", base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()})},
           {"format", "jpeg"}});
  }

  void finish() { file_.finish(); }

 private:
  void add(const char* topic, const char* schema) {
    channels_[topic] = file_.add_channel(topic, schema, message_schema(schema).dump());
  }
  void write(const std::string& topic, double time_s, const Json& message) {
    file_.write(channels_.at(topic), nanoseconds(time_s), message.dump());
  }
  void write_pose(const char* topic, const StampedPose& p) {
    Json covariance = Json::array();
    if (p.covariance)
      for (const double number : translation_first(*p.covariance, 1e-3).reshaped())
        covariance.push_back(number);
    write(topic, p.time_s,
          {{"timestamp", stamp(p.time_s)},
           {"frame_id", "map"},
           {"pose", pose_message(p.map_T_sensor)},
           {"covariance", std::move(covariance)}});
  }

  McapFile file_;
  const RunContents& run_;
  std::map<std::string, std::uint16_t> channels_;
  std::size_t pose_ = 0, keyframe_ = 0;
};

/// Writes the images of a log as far as it can be read. Returns why no more could be written, or "".
std::string write_pictures(RunRecorder& recorder, const RunContents& run, const RunReport::Log& log,
                           ProgressSink& progress, std::int64_t& written) {
  if (log.file.empty()) return "the run does not say which log it was made from";
  const std::filesystem::path config = run.folder / "config.yaml",
                              beside = std::filesystem::weakly_canonical(run.folder).parent_path(),
                              place = std::filesystem::weakly_canonical(log.file).lexically_relative(beside);
  try {
    if (!run.takes_any_log && (place.empty() || *place.begin() == ".."))
      throw Error(log.file + ": is not beside the run; --any-log takes it all the same");
    const SensorProfile profile =
        std::filesystem::exists(config) ? read_config(config).sensor : SensorProfile{};
    const auto source = open_frame_source(log.file, profile);
    progress.begin("pictures", source->frame_count());
    std::int64_t done = 0;
    for (auto image = source->next(); image; image = source->next()) {
      image->time_s += log.first_time_s;
      recorder.write_picture(*image);
      ++written;
      progress.update(++done);
    }
    progress.end();
    return source->warning();
  } catch (const Error& error) {
    progress.end();
    return error.what();
  }
}

}  // namespace

McapOutcome write_mcap(const std::filesystem::path& path, const RunContents& run, const VertexColors& colors,
                       ProgressSink& progress) {
  RunRecorder recorder(path, run);
  recorder.write_whole(colors);
  McapOutcome outcome;
  outcome.poses = static_cast<std::int64_t>(run.trajectory.size());
  for (const RunReport::Log& log : run.logs)
    append_sentence(outcome.missing, write_pictures(recorder, run, log, progress, outcome.pictures));
  recorder.write_poses(std::numeric_limits<double>::infinity());
  recorder.finish();
  return outcome;
}

}  // namespace gelslam
