#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/npy.hpp"

namespace gelslam::test {

/// A texture without end, seen through a small sensor that slides and twists over it.
inline Pose place_of_frame(int i) { return motion(0.1 * i, -0.05 * i, 0.4 * i, 0.05 * i, 0.02 * i, 0.4); }

inline SurfacePtr surface_at(const Pose& place) {
  static const Field texture = textured_plane(6);
  return touch(texture, place,
               View{.width_px = 160, .height_px = 120, .contact_width_px = 60, .contact_height_px = 45});
}

inline SurfacePtr surface_of_frame(int i) { return surface_at(place_of_frame(i)); }

/// A trial as the public TactileTracking data have them: gradient_maps.npy, contact_masks.npy and one true
/// pose per frame, no video, no configuration. `untouched` frames have no contact and no true pose.
inline void write_public_trial(const std::filesystem::path& folder, int frames,
                               const std::vector<int>& untouched = {}) {
  std::filesystem::create_directories(folder);
  std::vector<float> gradients, masks;
  std::vector<double> poses;
  for (int i = 0; i < frames; ++i) {
    const bool touches = std::find(untouched.begin(), untouched.end(), i) == untouched.end();
    const SurfacePtr surface = surface_of_frame(i);
    for (int v = 0; v < 120; ++v)
      for (int u = 0; u < 160; ++u) {
        const cv::Vec3f n = surface->normals(v, u);
        gradients.push_back(touches ? -n[0] / n[2] : 0.0F);
        gradients.push_back(touches ? -n[1] / n[2] : 0.0F);
        masks.push_back(touches && surface->contact(v, u) ? 1.0F : 0.0F);
      }
    Eigen::Matrix4d pose = (place_of_frame(0).inverse() * place_of_frame(i)).matrix();
    pose.topRightCorner<3, 1>() *= 1e-3;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c)
        poses.push_back(touches ? pose(r, c) : std::numeric_limits<double>::quiet_NaN());
  }
  const auto count = static_cast<std::size_t>(frames);
  write_npy(folder / "gradient_maps.npy", {count, 120, 160, 2}, std::span<const float>(gradients));
  write_npy(folder / "contact_masks.npy", {count, 120, 160}, std::span<const float>(masks));
  write_npy(folder / "true_start_T_currs.npy", {count, 4, 4}, std::span<const double>(poses));
}

/// Rewrites an array of up to four indices as numpy's float16.
inline void halve_precision(const std::filesystem::path& path) {
  const NpyArray array = read_npy(path);
  std::string shape, data;
  for (const std::size_t length : array.shape) shape += std::to_string(length) + ", ";
  for (const double value : array.to_doubles()) {
    const auto bits = Eigen::half(static_cast<float>(value)).x;
    data += static_cast<char>(bits & 0xFF);
    data += static_cast<char>(bits >> 8);
  }
  const std::string header = "{'descr': '<f2', 'fortran_order': False, 'shape': (" + shape + "), }\n";
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size());
  write_bytes(path, bytes + '\0' + header + data);
}

}  // namespace gelslam::test
