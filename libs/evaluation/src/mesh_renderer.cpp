#include "mesh_renderer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "parallel.hpp"

namespace gelslam::evaluation::detail {
namespace {

constexpr int kSubsamples = 2;            // per side of a pixel
constexpr int kOcclusionRays = 8;         // per subsample
constexpr double kOcclusionReach = 0.12;  // of the picture's width
constexpr float kAmbient = 0.30F, kHead = 0.20F, kKey = 0.72F, kSpecular = 0.05F;
const Eigen::Vector3f kInside(0.30F, 0.30F, 0.31F);  // the back of an open surface

/// A well-mixed number in [0, 1) for each (pixel, ray): grain that never changes (splitmix64).
double hashed(std::uint64_t n) {
  n += 0x9E3779B97F4A7C15ULL;
  n = (n ^ (n >> 30)) * 0xBF58476D1CE4E5B9ULL;
  n = (n ^ (n >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((n ^ (n >> 31)) >> 11) * 0x1.0p-53;
}

Eigen::Matrix3d basis_around(const Eigen::Vector3d& normal) {
  Eigen::Matrix3d basis;
  basis.col(2) = normal;
  basis.col(0) = normal.unitOrthogonal();
  basis.col(1) = normal.cross(basis.col(0));
  return basis;
}

Eigen::Vector3f background(double height_share) {
  const auto shade = static_cast<float>(0.97 - 0.09 * height_share);
  return {shade, shade, std::min(1.0F, shade * 1.01F)};
}

class Renderer {
 public:
  Renderer(const TriangleScene& scene, const View& view, const Framing& framing, const Albedo& albedo)
      : scene_(scene),
        view_(view),
        framing_(framing),
        albedo_(albedo),
        normals_(vertex_normals(scene.mesh())) {
    key_ = (0.65 * view.toward_viewer - 0.6 * view.right + 0.65 * view.up).normalized();
    half_ = (key_ + view.toward_viewer).normalized();
  }

  void render_row(int row, cv::Mat& picture) const {
    for (int column = 0; column < framing_.width_px; ++column) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int s = 0; s < kSubsamples * kSubsamples; ++s) {
        const double x = column + (s % kSubsamples + 0.5) / kSubsamples;
        const double y = row + (s / kSubsamples + 0.5) / kSubsamples;
        const auto sample = static_cast<std::uint64_t>((row * framing_.width_px + column) * 4 + s);
        sum += color_at(x, y, sample);
      }
      const Eigen::Vector3f mean = sum / static_cast<float>(kSubsamples * kSubsamples);
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(row, column);
      for (int c = 0; c < 3; ++c) {
        const float display = std::pow(std::clamp(mean[2 - c], 0.0F, 1.0F), 1.0F / 2.2F);
        pixel[c] = static_cast<std::uint8_t>(std::lround(255.0F * display));
      }
    }
  }

 private:
  Eigen::Vector3f color_at(double x, double y, std::uint64_t sample) const {
    const double right_mm = (x - 0.5 * framing_.width_px) * framing_.mm_per_px;
    const double up_mm = (0.5 * framing_.height_px - y) * framing_.mm_per_px;
    const Eigen::Vector3d origin = framing_.center_mm + right_mm * view_.right + up_mm * view_.up +
                                   framing_.depth_mm * view_.toward_viewer;
    const auto hit = scene_.cast(origin, -view_.toward_viewer, 2.0 * framing_.depth_mm);
    if (!hit) return background(y / framing_.height_px);
    return shade(*hit, origin - hit->distance_mm * view_.toward_viewer, sample);
  }

  Eigen::Vector3d smooth_normal(const RayHit& hit) const {
    const Eigen::Vector3i& t = scene_.mesh().triangles[static_cast<std::size_t>(hit.triangle)];
    const auto normal = [&](int k) -> Eigen::Vector3d {
      return normals_[static_cast<std::size_t>(t[k])].cast<double>();
    };
    const Eigen::Vector3d sum = (1.0 - hit.u - hit.v) * normal(0) + hit.u * normal(1) + hit.v * normal(2);
    return sum.allFinite() && sum.norm() > 1e-6 ? sum.normalized() : scene_.triangle_normal(hit.triangle);
  }

  Eigen::Vector3f shade(const RayHit& hit, const Eigen::Vector3d& point, std::uint64_t sample) const {
    Eigen::Vector3d normal = smooth_normal(hit);
    Eigen::Vector3d face = scene_.triangle_normal(hit.triangle);
    const bool inside = face.dot(view_.toward_viewer) < 0.0;
    if (inside) face = -face;
    if (normal.dot(face) < 0.0) normal = -normal;
    const auto positive = [](double value) { return static_cast<float>(std::max(0.0, value)); };
    const float open = openness(point, face, sample);
    const float light =
        kAmbient * open + (0.4F + 0.6F * open) * (kHead * positive(normal.dot(view_.toward_viewer)) +
                                                  kKey * positive(normal.dot(key_)));
    const float highlight = kSpecular * std::pow(positive(normal.dot(half_)), 40.0F);
    return light * (inside ? kInside : albedo_(hit)) + Eigen::Vector3f::Constant(highlight);
  }

  /// Share of the hemisphere, weighted by cosine, that nothing near blocks.
  float openness(const Eigen::Vector3d& point, const Eigen::Vector3d& face, std::uint64_t sample) const {
    const double reach = kOcclusionReach * framing_.mm_per_px * framing_.width_px;
    const Eigen::Vector3d origin = point + 1e-3 * reach * face;
    const Eigen::Matrix3d basis = basis_around(face);
    const double turn = hashed(2 * sample), shift = hashed(2 * sample + 1);
    int blocked = 0;
    for (int k = 0; k < kOcclusionRays; ++k) {
      const double radius2 = (k + shift) / kOcclusionRays;
      const double angle = 2.0 * std::numbers::pi * (turn + k * (0.5 * (3.0 - std::sqrt(5.0))));
      const double r = std::sqrt(radius2);
      const Eigen::Vector3d ray =
          basis * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), std::sqrt(1.0 - radius2));
      blocked += scene_.is_occluded(origin, ray, reach) ? 1 : 0;
    }
    return 1.0F - static_cast<float>(blocked) / kOcclusionRays;
  }

  const TriangleScene& scene_;
  const View& view_;
  const Framing& framing_;
  const Albedo& albedo_;
  std::vector<Eigen::Vector3f> normals_;
  Eigen::Vector3d key_, half_;
};

}  // namespace

cv::Mat render(const TriangleScene& scene, const View& view, const Framing& framing, const Albedo& albedo) {
  const Renderer renderer(scene, view, framing, albedo);
  cv::Mat picture(framing.height_px, framing.width_px, CV_8UC3);
  parallel_ranges(static_cast<std::size_t>(framing.height_px), [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) renderer.render_row(static_cast<int>(row), picture);
  });
  return picture;
}

}  // namespace gelslam::evaluation::detail
