// Sending blocks of a growing mesh to the GPU and drawing them, without a display. Under Mesa's software
// renderer the processor draws: times there are an upper bound for any GPU.
#include <benchmark/benchmark.h>
#include <epoxy/gl.h>

#include <cmath>
#include <memory>
#include <vector>

#include "gelslam/viewer/gl_context.hpp"
#include "gelslam/viewer/scene.hpp"

namespace gelslam {
namespace {

constexpr int kWidth = 1280, kHeight = 800, kBlockCells = 24;

/// A rolled-out wavy surface in square blocks of about 1150 triangles, as a live mesh has them.
std::vector<MeshBlock> wavy_blocks(int triangles) {
  const int side =
      std::max(1, static_cast<int>(std::lround(std::sqrt(triangles / (2.0 * kBlockCells * kBlockCells)))));
  const double cell_mm = 20.0 / (side * kBlockCells);
  std::vector<MeshBlock> blocks;
  for (int block = 0; block < side * side; ++block) {
    MeshBlock result;
    result.key = block;
    for (int j = 0; j <= kBlockCells; ++j) {
      for (int i = 0; i <= kBlockCells; ++i) {
        const double x = (block % side * kBlockCells + i) * cell_mm - 10,
                     y = (block / side * kBlockCells + j) * cell_mm - 10;
        const double z = 0.15 * std::sin(4 * x) * std::sin(4 * y);
        const Eigen::Vector3d slope(0.6 * std::cos(4 * x) * std::sin(4 * y),
                                    0.6 * std::sin(4 * x) * std::cos(4 * y), -1);
        result.mesh.vertices_mm.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
        result.mesh.normals.emplace_back(slope.normalized().cast<float>());
        result.mesh.confidence.push_back(1);
      }
    }
    for (int j = 0; j < kBlockCells; ++j) {
      for (int i = 0; i < kBlockCells; ++i) {
        const int a = j * (kBlockCells + 1) + i, b = a + 1, c = a + kBlockCells + 1, d = c + 1;
        result.mesh.triangles.emplace_back(a, d, b);
        result.mesh.triangles.emplace_back(a, c, d);
      }
    }
    blocks.push_back(std::move(result));
  }
  return blocks;
}

GlContext& context() {
  static const std::unique_ptr<GlContext> only = GlContext::offscreen();
  return *only;
}

/// One block changes: prepared and sent; range(0) triangles are there already.
void update_block(benchmark::State& state) {
  context().make_current();
  Scene scene;
  const std::vector<MeshBlock> blocks = wavy_blocks(static_cast<int>(state.range(0)));
  scene.update(blocks);
  std::size_t next = 0;
  for (auto _ : state) {
    scene.update(std::span(&blocks[next], 1));
    next = (next + 1) % blocks.size();
  }
  state.SetLabel(context().renderer());
}

/// A frame of 1280 x 800 until its last pixel; range(1): distance, mm.
void draw_frame(benchmark::State& state) {
  context().make_current();
  Scene scene;
  scene.update(wavy_blocks(static_cast<int>(state.range(0))));
  OrbitCamera camera;
  camera.set_distance_mm(static_cast<float>(state.range(1)));
  camera.orbit({100, 60}, {0, 0, kWidth, kHeight});
  RenderTarget target(kWidth, kHeight, 4);
  target.bind();
  for (auto _ : state) {
    scene.draw(camera, {0, 0, kWidth, kHeight}, SceneStyle());
    glFinish();
  }
  state.counters["drawn"] = static_cast<double>(scene.statistics().drawn_triangles);
}

BENCHMARK(update_block)
    ->Name("viewer/update_block")
    ->Arg(10'000)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(draw_frame)
    ->Name("viewer/draw_frame")
    ->ArgsProduct({{10'000, 100'000, 1'000'000}, {40, 150}})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()  // of all threads: a software renderer has its own
    ->UseRealTime();

}  // namespace
}  // namespace gelslam
