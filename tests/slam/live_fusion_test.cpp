#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../support/analytic_surface.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {
namespace {

// The newest of three patches, which is fused first, lies so far away that no grid of voxels can contain it.
// The others must be fused nevertheless, without waiting for another map.
TEST(LiveFusion, GoesOnAfterAPatchThatCannotBeFused) {
  LiveOptions options;
  options.mesh_feed = std::make_shared<MeshFeed>();
  LiveContext context(options, "a source");
  FusionStage fusion(context);
  auto map = std::make_shared<MapSnapshot>();
  map->shown_component = 0;
  const SurfacePtr surface = test::touch(test::textured_plane(1), test::motion(0, 0, 0, 0, 0, 0.4));
  for (int id = 0; id < 3; ++id)
    map->nodes.push_back({.keyframe = id,
                          .component_T_keyframe = Pose(Eigen::Translation3d(id == 2 ? 1e9 : id, 0, 0)),
                          .surface = surface});
  std::jthread thread([&] { fusion.run(); });
  fusion.set_map(map);
  std::size_t blocks = 0;
  for (int tries = 0; tries < 2000 && blocks == 0; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    blocks = options.mesh_feed->since(0, SIZE_MAX).blocks.size();
  }
  fusion.stop();
  EXPECT_GT(blocks, 0u);
  EXPECT_THAT(context.board.status().warnings, testing::Contains(testing::HasSubstr("cannot fuse")));
}

}  // namespace
}  // namespace gelslam::slam::detail
