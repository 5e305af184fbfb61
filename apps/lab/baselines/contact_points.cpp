#include "contact_points.hpp"

#include <algorithm>

namespace gelslam::baselines::detail {

ContactPoints contact_points(const Surface& surface, int max_points) {
  const cv::Size size = surface.contact.size();
  std::vector<cv::Point> pixels;
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u)
      if (surface.contact(v, u)) pixels.emplace_back(u, v);
  const std::size_t count = std::min(pixels.size(), static_cast<std::size_t>(std::max(0, max_points)));
  ContactPoints points;
  points.position_mm.reserve(count);
  points.normal.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const cv::Point p = pixels[(2 * k + 1) * pixels.size() / (2 * count)];
    const cv::Vec3f& n = surface.normals(p);
    points.position_mm.push_back(surface.point_mm(p));
    points.normal.emplace_back(n[0], n[1], n[2]);
  }
  return points;
}

}  // namespace gelslam::baselines::detail
