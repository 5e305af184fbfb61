// Turns a log into a mesh. Usage: reconstruct_to_ply LOG MESH.ply [MODEL]
#include <gelslam/core/error.hpp>
#include <gelslam/mesh/mesh_io.hpp>
#include <gelslam/slam/reconstruct.hpp>
#include <iostream>

int main(int argc, char** argv) try {
  if (argc < 3) throw gelslam::Error("usage: reconstruct_to_ply LOG MESH.ply [MODEL]");
  gelslam::LogInput input;
  input.log = argv[1];
  if (argc > 3) input.model = argv[3];
  gelslam::NoProgress silent;
  const gelslam::Run run =
      gelslam::reconstruct({.input = input, .config = resolve_config(input)}, silent, [] { return false; });
  write_mesh(argv[2], run.mesh);  // meters
  // save_run("RUN", run) writes all of it: trajectory, keyframes, pose graph, report.
  std::cout << run.map.trajectory().size() << " poses, " << run.mesh.vertices_mm.size() << " vertices\n";
} catch (const gelslam::Error& error) {
  std::cerr << error.what() << "\n";
  return 2;
}
