#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "gelslam/mesh/mesh_io.hpp"
#include "test_meshes.hpp"

namespace gelslam::test {

/// A run folder written by hand after docs/file-formats.md: flat touches of 32 x 24 pixels (0.1 mm), one
/// every second and 1.5 mm to the right, a trajectory of ten poses per second, and a mesh that covers them
/// all.
inline void write_run(const std::filesystem::path& folder, int keyframes) {
  namespace fs = std::filesystem;
  fs::create_directories(folder / "session");
  Mesh mesh =
      flipped(height_field(-1.2, 1.5 * keyframes - 0.3, -0.9, 0.9, 40, [](double, double) { return -0.3; }));
  mesh.confidence.assign(mesh.vertices_mm.size(), 1.0F);
  write_mesh(folder / "mesh.ply", mesh);
  nlohmann::json session = {{"version", 1},
                            {"anchor_frame", 10},
                            {"gradient_scale", 1.0},
                            {"width_px", 32},
                            {"height_px", 24},
                            {"pixel_pitch_mm", 0.1},
                            {"keyframes", nlohmann::json::array()}};
  std::ofstream keyframe_times(folder / "keyframes.tum"), trajectory(folder / "trajectory.tum"),
      graph(folder / "pose_graph.g2o");
  const std::string identity = " 0 0 0 0 0 1\n";
  for (int k = 0; k < keyframes; ++k) {
    const int id = 2 * k;  // ids need not be without gaps
    const double x_mm = 1.5 * k;
    session["keyframes"].push_back(
        {{"id", id},
         {"frame", 10 + 25 * k},
         {"trial", 0},
         {"box_px", {4, 3, 24, 18}},
         {"map_T_keyframe_mm", {1, 0, 0, x_mm, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}});
    cv::imwrite((folder / "session" / (std::to_string(id) + ".tiff")).string(),
                cv::Mat4f(18, 24, cv::Vec4f(0, 0, -0.3F, 0.01F)));
    keyframe_times << k << " " << x_mm / 1000 << identity;
    for (int i = 0; i < 10; ++i) trajectory << k + 0.1 * i << " " << (x_mm + 0.15 * i) / 1000 << identity;
    graph << "VERTEX_SE3:QUAT " << id << " 0 0 0 0 0 0 1\n";
    if (k > 0) graph << "EDGE_SE3:QUAT " << id - 2 << " " << id << " 0 0 0 0 0 0 1 1\n";
  }
  graph << "EDGE_SE3:QUAT 0 " << 2 * keyframes - 2 << " 0 0 0 0 0 0 1 1\nEDGE_SE3:QUAT nonsense\n\x01\x02\n";
  std::ofstream(folder / "session" / "session.json") << session;
}

}  // namespace gelslam::test
