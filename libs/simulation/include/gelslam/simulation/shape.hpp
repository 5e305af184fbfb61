#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// How an object can lie on the sensor, which decides what a scan motion may do with it.
enum class ShapeKind {
  body,  ///< round all over: rolls about any axis
  rod,   ///< long along its x axis: rolls about it, hardly tilts
  flat,  ///< a face (z = 0, outward +z) larger than the contact: slides and twists, hardly tilts
};

/// A rigid object in its own frame, millimeters. Immutable and thread-safe.
class Shape {
 public:
  virtual ~Shape() = default;
  virtual ShapeKind kind() const = 0;
  virtual Eigen::AlignedBox3f bounds_mm() const = 0;

  /// First point of the surface on the ray origin + t * direction (unit), 0 <= t <= t_max: t in mm, or
  /// +infinity. A ray that starts inside hits at 0.
  virtual float intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                          float t_max) const = 0;

  /// The crossing of the same ray next to `guess` (mm, from a neighboring ray), or NaN where it is not easily
  /// found: then intersect() must decide. Much cheaper than intersect() for shapes that are slow to evaluate.
  virtual float intersect_near(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                               float guess) const = 0;

  /// A lower bound of the distance to the surface, or 0 if none is known. Lets tiles be skipped.
  virtual float clearance(const Eigen::Vector3f& point) const = 0;

  /// The surface as a mesh with edges of about `spacing_mm`, vertices on the surface, normals outward.
  virtual Mesh mesh(float spacing_mm) const = 0;
};

using ShapePtr = std::shared_ptr<const Shape>;

/// What to make. Names: see shape_catalog(); a name that ends in .ply, .obj or .stl is a mesh file.
struct ShapeSpec {
  std::string name = "pebble";
  double size = 1.0;       ///< factor on the object's dimensions, 0.1 .. 10 (not on its texture)
  double texture = 1.0;    ///< factor on the height of its texture, 0 (polished) .. 3
  std::uint64_t seed = 1;  ///< of its texture
};

struct CatalogEntry {
  std::string name, description;
};
std::vector<CatalogEntry> shape_catalog();

/// Throws Error for an unknown name (naming the known ones), an unreadable mesh or parameters out of range.
ShapePtr make_shape(const ShapeSpec& spec);

/// A triangle mesh as a shape, by Embree. Its kind is guessed from its bounding box.
ShapePtr make_mesh_shape(const Mesh& mesh);

}  // namespace gelslam
