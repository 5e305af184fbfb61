#include "symmetric_meshes.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

namespace gelslam::lab {
namespace {

constexpr double kStepMm = 0.1;

/// Little hills and pits scattered over a rectangle about the origin.
class Bumps {
 public:
  Bumps(double width_mm, double height_mm, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto uniform = [&random](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const int count = static_cast<int>(width_mm * height_mm / 2);
    for (int i = 0; i < count; ++i)
      bumps_.push_back({uniform(-0.5, 0.5) * width_mm, uniform(-0.5, 0.5) * height_mm, uniform(0.3, 0.7),
                        uniform(-0.12, 0.12)});
  }
  double operator()(double x, double y) const {
    double z = 0;
    for (const Bump& b : bumps_) {
      const double r2 = ((x - b.x) * (x - b.x) + (y - b.y) * (y - b.y)) / (b.radius * b.radius);
      if (r2 < 9) z += b.height * std::exp(-r2);
    }
    return z;
  }

 private:
  struct Bump {
    double x, y, radius, height;
  };
  std::vector<Bump> bumps_;
};

/// A grid of triangles over [-w/2, w/2] x [-h/2, h/2], seen from the third axis' side.
void add_face(Mesh& mesh, double width_mm, double height_mm,
              const std::function<Eigen::Vector3d(double, double)>& point) {
  const int columns = static_cast<int>(std::ceil(width_mm / kStepMm)),
            rows = static_cast<int>(std::ceil(height_mm / kStepMm)),
            first = static_cast<int>(mesh.vertices_mm.size());
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices_mm.push_back(point((static_cast<double>(i) / columns - 0.5) * width_mm,
                                       (static_cast<double>(j) / rows - 0.5) * height_mm)
                                     .cast<float>());
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int corner = first + j * (columns + 1) + i, above = corner + columns + 1;
      mesh.triangles.emplace_back(corner, corner + 1, above);
      mesh.triangles.emplace_back(corner + 1, above + 1, above);
    }
}

}  // namespace

Mesh half_turn_plate() {
  constexpr double kWidthMm = 30, kHeightMm = 24, kThicknessMm = 4;
  const Bumps bumps(kWidthMm, kHeightMm, 11);
  Mesh mesh;
  add_face(mesh, kWidthMm, kHeightMm,
           [&](double x, double y) { return Eigen::Vector3d(x, y, bumps(x, y) + bumps(-x, -y)); });
  add_face(mesh, kWidthMm, kHeightMm,
           [&](double x, double y) { return Eigen::Vector3d(-x, y, -kThicknessMm); });
  return mesh;
}

Mesh six_fold_rod() {
  constexpr double kLengthMm = 46, kAcrossMm = 18;
  const double face_mm = kAcrossMm / std::sqrt(3.0);
  const Bumps bumps(kLengthMm, face_mm, 12);
  Mesh mesh;
  for (int side = 0; side < 6; ++side) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(side * M_PI / 3, Eigen::Vector3d::UnitX()).toRotationMatrix();
    add_face(mesh, kLengthMm, face_mm, [&](double x, double y) -> Eigen::Vector3d {
      const double fade = std::min(1.0, (0.5 * face_mm - std::abs(y)) / 0.5);  // faces meet in straight edges
      return turn * Eigen::Vector3d(x, y, 0.5 * kAcrossMm + fade * bumps(x, y));
    });
  }
  return mesh;
}

}  // namespace gelslam::lab
