#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/image/tiff.hpp"
#include "gelslam/surface/packed_surface.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

/// What version 1 has written: a unit normal's x and y, a height, and a curvature or NaN.
bool possible(const cv::Vec4f& value) {
  const bool unit = value[0] * value[0] + value[1] * value[1] <= 1.0001f;  // false for NaN
  return unit && std::isfinite(value[2]) && !std::isinf(value[3]);
}

SurfacePtr surface_from(const cv::Mat4f& packed, const cv::Rect& box, cv::Size size, double pixel_pitch_mm) {
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = pixel_pitch_mm;
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(size);
  surface->curvature = cv::Mat1f::zeros(size);
  for (int v = 0; v < box.height; ++v)
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      const cv::Vec4f& value = packed(v, u);
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

cv::Rect box_from(const Json& json, cv::Size size) {
  const auto numbers = json.get<std::vector<int>>();
  if (numbers.size() != 4) throw Error("box_px needs 4 numbers");
  const cv::Rect box(numbers[0], numbers[1], numbers[2], numbers[3]);
  const bool inside = box.x >= 0 && box.y >= 0 && box.width >= 0 && box.height >= 0 && box.x <= size.width &&
                      box.y <= size.height && box.width <= size.width - box.x &&
                      box.height <= size.height - box.y;
  if (!inside) throw Error("box_px leaves the image");
  return box;
}

cv::Mat4f read_patch(const fs::path& file, cv::Size size) {
  const cv::Mat4f values = read_float_tiff(file, size, 4);
  if (values.empty())
    throw Error(file.string() + ": missing, damaged or not the patch that session.json describes");
  if (!std::all_of(values.begin(), values.end(), possible))
    throw Error(file.string() + ": holds numbers that no surface has");
  return values;
}

PosedSurface load_patch(const fs::path& folder, const Json& entry, cv::Size size, double pixel_pitch_mm) {
  PosedSurface patch;
  patch.id = entry.at("id").get<int>();
  patch.map_T_keyframe = pose_from(entry.at("map_T_keyframe_mm"));
  const cv::Rect box = box_from(entry.at("box_px"), size);
  cv::Mat4f packed;
  if (!box.empty()) packed = read_patch(folder / (std::to_string(patch.id) + ".tiff"), box.size());
  patch.surface = StoredSurface(PackedSurface(*surface_from(packed, box, size, pixel_pitch_mm)));
  return patch;
}

}  // namespace

Session load_session_v1(const fs::path& folder, const Json& json) {
  Session session;
  // Older versions wrote "slope_gain".
  const char* scale_key = json.contains("gradient_scale") ? "gradient_scale" : "slope_gain";
  session.gradient_scale = json.at(scale_key).get<double>();
  if (!(session.gradient_scale > 0.1 && session.gradient_scale < 10))
    throw Error("impossible gradient scale");
  if (json.at("keyframes").empty()) return session;
  const cv::Size size(json.at("width_px").get<int>(), json.at("height_px").get<int>());
  const double pixel_pitch_mm = json.at("pixel_pitch_mm").get<double>();
  if (!is_possible_picture(size, pixel_pitch_mm)) throw Error("impossible image size or pixel pitch");
  for (const Json& entry : json.at("keyframes")) {
    PosedSurface patch = load_patch(folder, entry, size, pixel_pitch_mm);
    if (!session.patches.empty() && patch.id <= session.patches.back().id)
      throw Error("keyframe ids do not ascend");
    session.patches.push_back(std::move(patch));
  }
  return session;
}

}  // namespace gelslam::slam::detail
