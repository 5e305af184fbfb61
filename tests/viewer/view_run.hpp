#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/store.hpp"
#include "round_touch.hpp"
#include "test_meshes.hpp"

namespace gelslam::test {

inline void join(SlamMap& map, int from, int to, EdgeKind kind, bool outlier = false) {
  map.solved_edges.push_back({.from = from, .to = to, .kind = kind});
  map.solution.edge_outlier.push_back(outlier);
}

/// A run folder: round touches, one every second and 1.5 mm to the right, a trajectory of ten poses per
/// second, and a mesh that covers them all.
inline void write_run(const std::filesystem::path& folder, int keyframes, bool loop_is_outlier = false) {
  namespace fs = std::filesystem;
  fs::create_directories(folder);
  fs::remove(folder / "session.db");
  Mesh mesh =
      flipped(height_field(-1.2, 1.5 * keyframes - 0.3, -0.9, 0.9, 40, [](double, double) { return -0.3; }));
  mesh.confidence.assign(mesh.vertices_mm.size(), 1.0F);
  write_mesh(folder / "mesh.ply", mesh);
  SlamMap map;
  map.anchor_frame = 10;
  map.keyframes.resize(static_cast<std::size_t>(2 * keyframes - 1));  // ids need not be without gaps
  map.in_map.resize(map.keyframes.size());
  std::ofstream keyframe_times(folder / "keyframes.tum"), trajectory(folder / "trajectory.tum");
  const std::string identity = " 0 0 0 0 0 1\n";
  for (int k = 0; k < keyframes; ++k) {
    const int id = 2 * k;
    const double x_mm = 1.5 * k;
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id;
    keyframe->frame = 10 + 25 * k;
    keyframe->surface = round_touch();
    map.keyframes[static_cast<std::size_t>(id)] = keyframe;
    map.in_map[static_cast<std::size_t>(id)] = true;
    map.solution.component_of_node[id] = 0;
    map.solution.component_T_node[id] = Pose(Eigen::Translation3d(x_mm, 0, 0));
    keyframe_times << k << " " << x_mm / 1000 << identity;
    for (int i = 0; i < 10; ++i) trajectory << k + 0.1 * i << " " << (x_mm + 0.15 * i) / 1000 << identity;
    if (k > 0) join(map, id - 2, id, EdgeKind::odometry);
  }
  join(map, 0, 2 * keyframes - 2, EdgeKind::loop, loop_is_outlier);
  write_store(folder, map);
}

}  // namespace gelslam::test
