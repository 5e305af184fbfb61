#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// How an object can be placed on the sensor. It decides which motions a scan makes.
enum class ShapeKind {
  body,  ///< Round on all sides: rolls about any axis.
  rod,   ///< Long along its x axis: rolls about that axis and hardly tilts.
  /// Has a flat face (z = 0, outward +z) larger than the contact: slides and twists, and hardly tilts.
  flat,
};

/// A rigid object in its own frame, millimeters. Immutable and thread-safe.
class Shape {
 public:
  virtual ~Shape() = default;
  virtual ShapeKind kind() const = 0;
  virtual Eigen::AlignedBox3f bounds_mm() const = 0;

  /// Returns the first intersection of the surface with the ray origin + t * direction (unit vector), 0 <= t
  /// <= t_max, as t in mm; +infinity if there is none. A ray that starts inside hits at 0.
  virtual float intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                          float t_max) const = 0;

  /// Returns the intersection of the same ray near `guess` (mm, from a neighboring ray), or NaN if it is not
  /// easily found; then intersect() must be called. Much faster than intersect() for shapes that are slow to
  /// evaluate.
  virtual float intersect_near(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                               float guess) const = 0;

  /// Returns a lower bound of the distance to the surface, or 0 if none is known. It allows tiles of the
  /// image to be skipped.
  virtual float clearance(const Eigen::Vector3f& point) const = 0;

  /// Returns the surface as a mesh with edges of about `spacing_mm`, vertices on the surface, and normals
  /// outward.
  virtual Mesh mesh(float spacing_mm) const = 0;
};

using ShapePtr = std::shared_ptr<const Shape>;

/// The object to make. For names see shape_catalog(); a name that ends in .ply, .obj or .stl is a mesh file.
struct ShapeSpec {
  std::string name = "pebble";
  double size = 1.0;       ///< Factor on the object's dimensions (not on its texture), 0.1 .. 10.
  double texture = 1.0;    ///< Factor on the height of its texture, 0 (polished) .. 3.
  std::uint64_t seed = 1;  ///< Determines the texture.
};

struct CatalogEntry {
  std::string name, description;
};
std::vector<CatalogEntry> shape_catalog();

/// Throws Error for an unknown name (naming the known ones), an unreadable mesh or parameters out of range.
ShapePtr make_shape(const ShapeSpec& spec);

/// Makes a shape from a triangle mesh, with Embree. Its kind is guessed from its bounding box.
ShapePtr make_mesh_shape(const Mesh& mesh);

}  // namespace gelslam
