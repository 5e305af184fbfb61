// How much of the touched surface is in the mesh. The contact of each keyframe is divided into small squares.
// The area of a square is divided by the number of keyframes of the same component that show it, so that the
// sum over all keyframes counts every part of the object once. A square is in the mesh when a vertex is near
// its center. It counts as not joined when no keyframe that shows it is placed in the map.

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "gelslam/core/parallel.hpp"
#include "gelslam/core/point_grid.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/contact_overlap.hpp"

namespace gelslam {
namespace {

/// Center points of a contact's squares, with two edge vectors per square (mm, in the keyframe's frame).
struct TouchedPatch {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<std::array<Eigen::Vector3d, 2>> sides_mm;
  double half_square_mm;
  ContactExtent extent;
  ContactRelief relief;
};

TouchedPatch patch_of(const Surface& surface, double gradient_scale) {
  const CameraModel camera = surface.camera();
  const auto point_mm = [&](int u, int v) {
    return camera.point_mm({u, v}, static_cast<double>(surface.height_mm(v, u)) / gradient_scale);
  };
  constexpr int kHalf = kContactPointStepPx / 2;
  // The distance from the first to the last pixel of a square is one pixel less than its side.
  constexpr double kWhole = kContactPointStepPx / (kContactPointStepPx - 1.0);
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<std::array<Eigen::Vector3d, 2>> sides_mm;
  for (int v = kHalf; v + kHalf <= surface.contact.rows; v += kContactPointStepPx)
    for (int u = kHalf; u + kHalf <= surface.contact.cols; u += kContactPointStepPx) {
      if (!surface.contact(v, u)) continue;
      points_mm.push_back(point_mm(u, v));
      sides_mm.push_back({kWhole * (point_mm(u + kHalf - 1, v) - point_mm(u - kHalf, v)),
                          kWhole * (point_mm(u, v + kHalf - 1) - point_mm(u, v - kHalf))});
    }
  sides_mm.shrink_to_fit();
  return {points_mm, std::move(sides_mm), kHalf * surface.pixel_pitch_mm, extent_of(points_mm),
          ContactRelief(surface, /*cell_px=*/4)};
}

TouchedSquare square_at(const Pose& pose, const Eigen::Vector3d& point_mm,
                        const std::array<Eigen::Vector3d, 2>& sides_mm) {
  const auto corner = [&](double u, double v) -> Eigen::Vector3f {
    return (pose * (point_mm + u * sides_mm[0] + v * sides_mm[1])).cast<float>();
  };
  return {corner(-0.5, -0.5), corner(0.5, -0.5), corner(-0.5, 0.5), corner(0.5, 0.5)};
}

/// Another keyframe that may show points of a contact.
struct Beside {
  const ContactRelief* relief;
  Pose other_T_patch;
  bool placed;
};

}  // namespace

RunReport::Touched touched_surface(const MapSnapshot& map, const Mesh& mesh, int threads,
                                   std::vector<TouchedSquare>* not_in_mesh) {
  const std::vector<MapSnapshot::Node>& nodes = map.nodes;
  if (nodes.empty()) return {};
  double reach_mm = typical_edge_mm(mesh);  // Every point of the mesh is nearer than this to a vertex.
  std::vector<std::optional<TouchedPatch>> patches(nodes.size());
  parallel_for(nodes.size(), threads, [&](std::size_t i) {
    patches[i] = patch_of(*nodes[i].surface.get(), map.gradient_scale.mean());
  });
  for (const auto& patch : patches) reach_mm = std::max(reach_mm, patch->half_square_mm);
  std::vector<Eigen::Vector3d> vertices_mm;
  vertices_mm.reserve(mesh.vertices_mm.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) vertices_mm.push_back(vertex.cast<double>());
  const PointGrid vertices(std::move(vertices_mm), reach_mm);
  std::vector<RunReport::Touched> touched(nodes.size());
  std::vector<std::vector<TouchedSquare>> left_out(nodes.size());
  parallel_for(nodes.size(), threads, [&](std::size_t i) {
    const TouchedPatch& patch = *patches[i];
    std::vector<Beside> beside;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Pose other_T_patch = nodes[k].component_T_keyframe.inverse() * nodes[i].component_T_keyframe;
      if (k != i && nodes[k].component == nodes[i].component &&
          may_overlap(patches[k]->extent, patch.extent, other_T_patch))
        beside.push_back({&patches[k]->relief, other_T_patch, nodes[k].placed});
    }
    for (std::size_t k = 0; k < patch.points_mm.size(); ++k) {
      const Eigen::Vector3d& point_mm = patch.points_mm[k];
      int shown = 1;
      bool joined = nodes[i].placed, meshed = false;
      for (const Beside& other : beside)
        if (shows(*other.relief, other.other_T_patch * point_mm)) {
          ++shown;
          joined = joined || other.placed;
        }
      if (joined)
        vertices.visit(nodes[i].component_T_keyframe * point_mm, reach_mm,
                       [&](std::size_t) { meshed = true; });
      const double area_cm2 = 0.01 * patch.sides_mm[k][0].cross(patch.sides_mm[k][1]).norm() / shown;
      touched[i].area_cm2 += area_cm2;
      if (meshed) touched[i].in_mesh_cm2 += area_cm2;
      if (!joined) touched[i].not_joined_cm2 += area_cm2;
      if (joined && !meshed && not_in_mesh != nullptr)
        left_out[i].push_back(square_at(nodes[i].component_T_keyframe, point_mm, patch.sides_mm[k]));
    }
  });
  RunReport::Touched sum;
  for (const RunReport::Touched& of_keyframe : touched) {
    sum.area_cm2 += of_keyframe.area_cm2;
    sum.in_mesh_cm2 += of_keyframe.in_mesh_cm2;
    sum.not_joined_cm2 += of_keyframe.not_joined_cm2;
  }
  if (not_in_mesh != nullptr)
    for (const auto& squares : left_out)
      not_in_mesh->insert(not_in_mesh->end(), squares.begin(), squares.end());
  return sum;
}

}  // namespace gelslam
