#include "scene/scene_touch.hpp"

#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3d;

constexpr int kFewPixels = 3000;
/// The contact mask consists of blocks of pixels. Blurred, it ends in a smooth line, 0.8 pixels further
/// outside.
constexpr double kBlurPx = 3;
constexpr float kBlurAtBorder = 0.4F;

}  // namespace

TouchMesh make_touch_mesh(const Surface& s, double gradient_scale) {
  TouchMesh mesh;
  const int step = s.contact_pixels > kFewPixels ? 2 : 1, width = s.contact.cols, height = s.contact.rows;
  const CameraModel camera = s.camera();
  cv::Mat1f inside;
  s.contact.convertTo(inside, CV_32F, 1.0 / 255);
  cv::GaussianBlur(inside, inside, {}, kBlurPx);
  inside = (inside - kBlurAtBorder) / (1 - kBlurAtBorder);
  cv::Mat1i index((height + step - 1) / step, (width + step - 1) / step, -1);
  for (int v = 0; v < height; v += step) {
    for (int u = 0; u < width; u += step) {
      const cv::Vec3f& n = s.normals(v, u);
      const float z = s.height_mm(v, u);
      if (inside(v, u) < -0.5F || !std::isfinite(z) || !std::isfinite(n[0] + n[1] + n[2])) continue;
      const Vector3d p = camera.point_mm(cv::Point(u, v), z / gradient_scale);
      index(v / step, u / step) = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(
          {p.cast<float>(), -Vector3d(n[0], n[1], n[2] * gradient_scale).cast<float>(), inside(v, u)});
    }
  }
  const auto add = [&](int a, int b, int c) {
    if (a >= 0 && b >= 0 && c >= 0) mesh.triangles.emplace_back(a, b, c);
  };
  // Seen from outside, against the sensor's z axis, y points down, so the order of the image's corners is
  // counter-clockwise.
  for (int v = 0; v + 1 < index.rows; ++v) {
    for (int u = 0; u + 1 < index.cols; ++u) {
      const int a = index(v, u), b = index(v, u + 1), c = index(v + 1, u), d = index(v + 1, u + 1);
      add(a, c, d);
      add(a, d, b);
    }
  }
  return mesh;
}

TouchMesh make_touch_mesh(const std::vector<TouchedSquare>& squares) {
  TouchMesh mesh;
  for (const TouchedSquare& square : squares) {
    const auto first = static_cast<int>(mesh.vertices.size());
    const Eigen::Vector3f normal = (square[2] - square[0]).cross(square[1] - square[0]).normalized();
    for (const Eigen::Vector3f& corner : square) mesh.vertices.push_back({corner, normal, 1});
    mesh.triangles.emplace_back(first, first + 2, first + 3);
    mesh.triangles.emplace_back(first, first + 3, first + 1);
  }
  return mesh;
}

std::vector<SceneLine> sensor_outlines(const TouchPatch& touch) {
  std::vector<SceneLine> lines;
  for (const auto& [map_T_sensor, opacity] : touch.places) {
    const double x = 0.5 * touch.surface->contact.cols * touch.surface->pixel_pitch_mm;
    const double y = 0.5 * touch.surface->contact.rows * touch.surface->pixel_pitch_mm;
    const Vector3d corners[] = {{-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}};
    const Rgba color = {255, 150, 40, static_cast<std::uint8_t>(255 * opacity)};
    for (std::size_t i = 0; i < 4; ++i)
      lines.push_back({(map_T_sensor * corners[i]).cast<float>(),
                       (map_T_sensor * corners[(i + 1) % 4]).cast<float>(), color, 2.0F});
  }
  return lines;
}

void TouchMesh::Vertex::set_attributes() {
  set_attribute<Vertex>(0, 3, offsetof(Vertex, position_mm));
  set_attribute<Vertex>(1, 3, offsetof(Vertex, normal));
  set_attribute<Vertex>(2, 1, offsetof(Vertex, inside));
}

}  // namespace gelslam::viewer::detail
