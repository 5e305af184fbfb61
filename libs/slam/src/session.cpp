#include "gelslam/slam/session.hpp"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr int kMaxSide = 8192;

fs::path patch_file(const fs::path& folder, int id) { return folder / (std::to_string(id) + ".tiff"); }

/// The part of a surface that carries anything, as four planes; curvature is NaN outside contact, so that the mask
/// needs no plane of its own.
cv::Mat4f pack(const Surface& surface, const cv::Rect& box) {
  cv::Mat4f packed(box.size());
  for (int v = 0; v < box.height; ++v)
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      const cv::Vec3f n = surface.normals(p);
      packed(v, u) = {n[0], n[1], surface.height_mm(p), surface.contact(p) ? surface.curvature(p) : std::nanf("")};
    }
  return packed;
}

SurfacePtr unpack(const cv::Mat4f& packed, const cv::Rect& box, cv::Size size, double pixel_pitch_mm) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = pixel_pitch_mm;
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(size);
  surface->curvature = cv::Mat1f::zeros(size);
  for (int v = 0; v < box.height; ++v)
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      const cv::Vec4f value = packed(v, u);
      surface->normals(p) = {value[0], value[1], std::sqrt(std::fmax(0.0f, 1.0f - value[0] * value[0] - value[1] * value[1]))};
      surface->height_mm(p) = value[2];
      if (std::isnan(value[3])) continue;
      surface->contact(p) = 255;
      surface->curvature(p) = value[3];
      ++surface->contact_pixels;
    }
  return surface;
}

std::vector<double> numbers(const Pose& pose) {
  std::vector<double> values;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) values.push_back(pose.matrix()(r, c));
  return values;
}

Pose pose_from(const ordered_json& json) {
  const auto values = json.get<std::vector<double>>();
  if (values.size() != 16) throw Error("a pose needs 16 numbers");
  Pose pose = Pose::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) pose(r, c) = values[static_cast<std::size_t>(r * 4 + c)];
  if (!pose.matrix().allFinite() || std::abs(pose.linear().determinant() - 1.0) > 1e-6) throw Error("a pose is no rigid motion");
  return pose;
}

PosedSurface load_patch(const fs::path& folder, const ordered_json& entry, cv::Size size, double pixel_pitch_mm) {
  PosedSurface patch;
  patch.id = entry.at("id").get<int>();
  patch.map_T_keyframe = pose_from(entry.at("map_T_keyframe_mm"));
  const auto numbers = entry.at("box_px").get<std::vector<int>>();
  if (numbers.size() != 4) throw Error("box_px needs 4 numbers");
  const cv::Rect box(numbers[0], numbers[1], numbers[2], numbers[3]);
  if (box.width < 0 || box.height < 0 || (box & cv::Rect({0, 0}, size)) != box) throw Error("box_px leaves the image");
  cv::Mat packed;
  if (!box.empty()) {
    packed = cv::imread(patch_file(folder, patch.id).string(), cv::IMREAD_UNCHANGED);
    if (packed.empty() || packed.type() != CV_32FC4 || packed.size() != box.size())
      throw Error(patch_file(folder, patch.id).string() + ": damaged or not the patch that session.json describes");
  }
  patch.surface = unpack(packed, box, size, pixel_pitch_mm);
  return patch;
}

}  // namespace

void save_session(const fs::path& folder, const SlamMap& map) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw Error(folder.string() + ": cannot create the folder: " + code.message());
  ordered_json json;
  json["version"] = kVersion;
  json["anchor_frame"] = map.anchor_frame;
  json["slope_gain"] = map.solution.slope_gain.mean();
  json["keyframes"] = ordered_json::array();
  for (const PosedSurface& patch : posed_surfaces(map)) {
    const Keyframe& keyframe = *map.keyframes[static_cast<std::size_t>(patch.id)];
    const cv::Rect box = cv::boundingRect(patch.surface->contact);
    json["width_px"] = patch.surface->contact.cols;
    json["height_px"] = patch.surface->contact.rows;
    json["pixel_pitch_mm"] = patch.surface->pixel_pitch_mm;
    json["keyframes"].push_back({{"id", patch.id},
                                 {"frame", keyframe.frame},
                                 {"trial", keyframe.trial},
                                 {"box_px", {box.x, box.y, box.width, box.height}},
                                 {"map_T_keyframe_mm", numbers(patch.map_T_keyframe)}});
    if (!box.empty() && !cv::imwrite(patch_file(folder, patch.id).string(), pack(*patch.surface, box)))
      throw Error(patch_file(folder, patch.id).string() + ": cannot write; is the disk full?");
  }
  write_file_atomically(folder / "session.json", json.dump(1) + "\n");
}

Session load_session(const fs::path& folder) {
  const fs::path file = folder / "session.json";
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + ": cannot be read");
  try {
    const ordered_json json = ordered_json::parse(stream);
    if (json.at("version").get<int>() != kVersion) throw Error("written by another version of the program");
    Session session;
    session.slope_gain = json.at("slope_gain").get<double>();
    if (json.at("keyframes").empty()) return session;
    const cv::Size size(json.at("width_px").get<int>(), json.at("height_px").get<int>());
    if (size.width < 1 || size.height < 1 || size.width > kMaxSide || size.height > kMaxSide) throw Error("impossible image size");
    for (const ordered_json& entry : json.at("keyframes"))
      session.patches.push_back(load_patch(folder, entry, size, json.at("pixel_pitch_mm").get<double>()));
    return session;
  } catch (const nlohmann::json::exception& error) {
    throw Error(file.string() + ": not a session: " + error.what());
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
}

}  // namespace gelslam
