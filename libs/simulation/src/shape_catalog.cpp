#include <array>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "random.hpp"
#include "shape_makers.hpp"

namespace gelslam {
namespace {

using simulation::detail::ShapeDials;
namespace makers = simulation::detail;

struct ShapeEntry : CatalogEntry {
  ShapePtr (*make)(const ShapeDials&);
};

const std::array<ShapeEntry, 8> kShapes = {{
    {"pebble", "stone of 21 x 17 x 14 mm with bumps and grain", makers::make_pebble},
    {"peanut", "two lobes, 24 x 13 mm, shell ridges", makers::make_peanut},
    {"coin", "disc of 24 mm: rim, beads, letters, modeled center", makers::make_coin},
    {"plank", "44 x 32 mm of wood grain", makers::make_plank},
    {"golf", "ball of 42.7 mm with dimples (nearly periodic)", makers::make_golf_ball},
    {"knurl", "rod of 11 mm with diamond knurling (nearly periodic)", makers::make_knurl},
    {"screw", "rod of 9 mm with a 1.5 mm thread (turning looks like sliding)", makers::make_screw},
    {"sphere", "polished ball of 16 mm (shows no rotation)", makers::make_sphere},
}};

ShapePtr make_from_file(const ShapeSpec& spec) {
  Mesh mesh = read_mesh(spec.name);
  if (const std::string warning = size_warning(mesh); !warning.empty())
    throw Error(spec.name + " " + warning);
  for (Eigen::Vector3f& vertex : mesh.vertices_mm) vertex *= static_cast<float>(spec.size);
  return make_mesh_shape(mesh);
}

}  // namespace

std::vector<CatalogEntry> shape_catalog() { return {kShapes.begin(), kShapes.end()}; }

ShapePtr make_shape(const ShapeSpec& spec) {
  if (!(spec.size >= 0.1 && spec.size <= 10)) throw Error("object size factor must be between 0.1 and 10");
  if (!(spec.texture >= 0 && spec.texture <= 3)) throw Error("object texture factor must be between 0 and 3");
  if (is_mesh_name(spec.name)) return make_from_file(spec);
  // The lattices of consecutive seeds are unrelated after hashing.
  const ShapeDials dials{static_cast<float>(spec.size), static_cast<float>(spec.texture),
                         static_cast<std::uint32_t>(makers::hash(spec.seed))};
  std::string names;
  for (const ShapeEntry& entry : kShapes) {
    if (spec.name == entry.name) return entry.make(dials);
    names += std::string(names.empty() ? "" : ", ") + entry.name;
  }
  throw Error("unknown object '" + spec.name + "'; known are " + names + ", or a .ply, .obj or .stl file");
}

}  // namespace gelslam
