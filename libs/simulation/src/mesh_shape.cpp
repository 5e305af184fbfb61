#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/shape.hpp"
#include "mesh_scene.hpp"

namespace gelslam {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kMaxMeshTriangles = 20'000'000;

class MeshShape final : public Shape {
 public:
  explicit MeshShape(const Mesh& mesh) : mesh_(mesh) {
    check_measurable(mesh_);
    for (const Vector3f& vertex : mesh_.vertices_mm) bounds_.extend(vertex);
    triangles_ = embree::MeshScene(mesh_);
  }

  ShapeKind kind() const override {
    const Vector3f size = bounds_.sizes();
    const float across = std::max(size.y(), size.z());
    if (size.z() < 0.25F * std::min(size.x(), size.y())) return ShapeKind::flat;
    const bool round = std::min(size.y(), size.z()) > 0.8F * across;
    return round && size.x() > 2.2F * across ? ShapeKind::rod : ShapeKind::body;
  }
  Eigen::AlignedBox3f bounds_mm() const override { return bounds_; }

  float intersect(const Vector3f& origin, const Vector3f& direction, float t_max) const override {
    const RTCRayHit ray = embree::first_hit(triangles_, origin, direction, t_max);
    if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::numeric_limits<float>::infinity();
    const Vector3f normal(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z);
    // The ray leaves through a back face, so it started inside.
    return normal.dot(direction) > 0 ? 0.0F : ray.ray.tfar;
  }

  float intersect_near(const Vector3f&, const Vector3f&, float) const override {
    // An initial guess does not speed up the search in a tree of boxes.
    return std::numeric_limits<float>::quiet_NaN();
  }

  float clearance(const Vector3f& point) const override { return bounds_.exteriorDistance(point); }

  Mesh mesh(float spacing_mm) const override {
    if (!(spacing_mm > 1e-3F)) throw Error("mesh spacing must be more than 0.001 mm");
    Mesh result;
    for (const Eigen::Vector3i& t : mesh_.triangles) {
      const Vector3f &a = corner(t[0]), &b = corner(t[1]), &c = corner(t[2]);
      const float longest =
          std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
      append_divided(result, a, b, c, std::max(1, static_cast<int>(std::ceil(longest / spacing_mm))));
    }
    return result;
  }

 private:
  const Vector3f& corner(int index) const { return mesh_.vertices_mm[static_cast<std::size_t>(index)]; }

  /// Splits a triangle into n * n equal ones. Different input triangles do not share vertices.
  static void append_divided(Mesh& mesh, const Vector3f& a, const Vector3f& b, const Vector3f& c, int n) {
    if (mesh.triangles.size() + static_cast<std::size_t>(n) * static_cast<std::size_t>(n) > kMaxMeshTriangles)
      throw Error("the object's mesh is too large to be sampled finely; check its unit");
    const int first = static_cast<int>(mesh.vertices_mm.size());
    const Vector3f normal = (b - a).cross(c - a).normalized();
    const auto index = [first, n](int i, int j) { return first + i * (2 * n + 3 - i) / 2 + j; };
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n - i; ++j) {
        const float u = static_cast<float>(i) / static_cast<float>(n),
                    v = static_cast<float>(j) / static_cast<float>(n);
        mesh.vertices_mm.push_back(a + u * (b - a) + v * (c - a));
        mesh.normals.push_back(normal);
      }
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n - i; ++j) {
        mesh.triangles.emplace_back(index(i, j), index(i + 1, j), index(i, j + 1));
        if (j < n - i - 1) mesh.triangles.emplace_back(index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
      }
  }

  Mesh mesh_;
  Eigen::AlignedBox3f bounds_;
  embree::MeshScene triangles_;
};

}  // namespace

ShapePtr make_mesh_shape(const Mesh& mesh) { return std::make_shared<MeshShape>(mesh); }

}  // namespace gelslam
