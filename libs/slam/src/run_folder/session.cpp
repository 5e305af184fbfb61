#include "gelslam/slam/session.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <vector>

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr int kMaxSide = 8192;

fs::path patch_file(const fs::path& folder, int id) { return folder / (std::to_string(id) + ".tiff"); }

/// The part of a surface that carries anything, as four planes; curvature is NaN outside contact, so that the
/// mask needs no plane of its own.
cv::Mat4f pack(const Surface& surface, const cv::Rect& box) {
  cv::Mat4f packed(box.size());
  for (int v = 0; v < box.height; ++v)
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      const cv::Vec3f n = surface.normals(p);
      packed(v, u) = {n[0], n[1], surface.height_mm(p),
                      surface.contact(p) ? surface.curvature(p) : std::nanf("")};
    }
  return packed;
}

/// What pack() can have written: a unit normal's x and y, a height, and a curvature or NaN.
bool possible(const cv::Vec4f& value) {
  const bool unit = value[0] * value[0] + value[1] * value[1] <= 1.0001f;  // false for NaN
  return unit && std::isfinite(value[2]) && !std::isinf(value[3]);
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
      surface->normals(p) = {value[0], value[1],
                             std::sqrt(std::fmax(0.0f, 1.0f - value[0] * value[0] - value[1] * value[1]))};
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
  const bool rotation = pose.linear().isUnitary(1e-6) && std::abs(pose.linear().determinant() - 1.0) < 1e-6;
  if (!pose.matrix().allFinite() || !rotation) throw Error("a pose is no rigid motion");
  return pose;
}

cv::Rect box_from(const ordered_json& json, cv::Size size) {
  const auto numbers = json.get<std::vector<int>>();
  if (numbers.size() != 4) throw Error("box_px needs 4 numbers");
  const cv::Rect box(numbers[0], numbers[1], numbers[2], numbers[3]);
  const bool inside = box.x >= 0 && box.y >= 0 && box.width >= 0 && box.height >= 0 && box.x <= size.width &&
                      box.y <= size.height && box.width <= size.width - box.x &&
                      box.height <= size.height - box.y;
  if (!inside) throw Error("box_px leaves the image");
  return box;
}

/// Encoded in memory: libtiff says more than one line about a full disk.
void write_patch(const fs::path& file, const cv::Mat4f& packed) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".tiff", packed, bytes)) throw Error(file.string() + ": cannot be encoded");
  write_file_atomically(file, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

cv::Mat4f read_patch(const fs::path& file, cv::Size size) {
  cv::Mat packed;
  try {
    if (fs::is_regular_file(file)) packed = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // sizes beyond OpenCV's limits
  }
  if (packed.empty() || packed.type() != CV_32FC4 || packed.size() != size)
    throw Error(file.string() + ": missing, damaged or not the patch that session.json describes");
  const cv::Mat4f values = packed;
  if (!std::all_of(values.begin(), values.end(), possible))
    throw Error(file.string() + ": holds numbers that no surface has");
  return values;
}

PosedSurface load_patch(const fs::path& folder, const ordered_json& entry, cv::Size size,
                        double pixel_pitch_mm) {
  PosedSurface patch;
  patch.id = entry.at("id").get<int>();
  patch.map_T_keyframe = pose_from(entry.at("map_T_keyframe_mm"));
  const cv::Rect box = box_from(entry.at("box_px"), size);
  cv::Mat4f packed;
  if (!box.empty()) packed = read_patch(patch_file(folder, patch.id), box.size());
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
  json["gradient_scale"] = map.surface_scale().mean();
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
    if (!box.empty()) write_patch(patch_file(folder, patch.id), pack(*patch.surface, box));
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
    // Older versions wrote "slope_gain".
    const char* scale_key = json.contains("gradient_scale") ? "gradient_scale" : "slope_gain";
    session.gradient_scale = json.at(scale_key).get<double>();
    if (!(session.gradient_scale > 0.1 && session.gradient_scale < 10))
      throw Error("impossible gradient scale");
    if (json.at("keyframes").empty()) return session;
    const cv::Size size(json.at("width_px").get<int>(), json.at("height_px").get<int>());
    if (size.width < 1 || size.height < 1 || size.width > kMaxSide || size.height > kMaxSide)
      throw Error("impossible image size");
    const double pixel_pitch_mm = json.at("pixel_pitch_mm").get<double>();
    if (!(pixel_pitch_mm > 0 && pixel_pitch_mm <= 10)) throw Error("impossible pixel pitch");
    for (const ordered_json& entry : json.at("keyframes")) {
      PosedSurface patch = load_patch(folder, entry, size, pixel_pitch_mm);
      if (!session.patches.empty() && patch.id <= session.patches.back().id)
        throw Error("keyframe ids do not ascend");
      session.patches.push_back(std::move(patch));
    }
    return session;
  } catch (const nlohmann::json::exception&) {
    throw Error(file.string() + ": damaged, or not a session of gelslam");
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
}

}  // namespace gelslam
