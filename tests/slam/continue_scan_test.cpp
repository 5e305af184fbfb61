#include "gelslam/slam/continue_scan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

#include "../support/database.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/slam/store.hpp"
#include "run_folder/run_writer.hpp"
#include "strokes.hpp"

namespace gelslam::test {
namespace {

/// Expects that two maps are equal to the last bit. This is possible because keyframes are rounded as in
/// their files when they are made.
void expect_same_map(const SlamMap& a, const SlamMap& b) {
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.loops, b.loops);
  EXPECT_EQ(a.anchor_frame, b.anchor_frame);
  EXPECT_EQ(a.in_map, b.in_map);
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  for (const auto& [id, pose] : a.solution.component_T_node)
    EXPECT_EQ(pose.matrix(), b.solution.component_T_node.at(id).matrix()) << id;
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i)
    EXPECT_EQ(a.frames[i].keyframe_T_frame.matrix(), b.frames[i].keyframe_T_frame.matrix());
}

TEST(ContinuedScan, EqualsAScanInOneGo) {
  const TemporaryFolder folder;
  Strokes whole, first;
  for (Strokes* scan : {&whole, &first}) {
    scan->stroke(0, 0, 0);
    scan->stroke(0.8, 0.6, 50);
  }
  write_store(folder.path(), first.finish());
  Strokes second(read_scan(folder.path(), {}));
  for (Strokes* scan : {&whole, &second}) {
    scan->stroke(1.5, -0.5, -30);
    scan->stroke(2.5, 0.1, 10);
  }
  const SlamMap map = second.finish();
  EXPECT_EQ(map.components, 1);
  EXPECT_EQ(map.trials, 4);
  expect_same_map(map, whole.finish());
}

TEST(ContinuedScan, KeepsTheMapHoweverMuchDoesNotJoinIt) {
  Strokes first;
  first.stroke(0, 0, 0);
  first.stroke(0.8, 0.6, 50);
  const SlamMap map = first.finish();
  ScanRecord so_far = map;
  so_far.parts.push_back({so_far.next_frame(), "two", 5, ""});
  Strokes second(so_far);
  for (const auto& [x, y, twist] : {std::tuple(40.0, 0.0, 0.0), {40.8, 0.6, 50}, {41.5, -0.5, -30}})
    second.stroke(x, y, twist);
  const SlamMap more = second.finish();
  ASSERT_EQ(more.components, 2);
  ASSERT_GT(more.keyframes.size(), 2 * map.keyframes.size());
  EXPECT_EQ(more.anchor_frame, map.anchor_frame);
  for (std::size_t id = 0; id < more.keyframes.size(); ++id)
    EXPECT_EQ(more.in_map[id], id < map.keyframes.size()) << id;
}

/// After the program was killed, the loops of the last keyframes have not been searched yet.
TEST(ContinuedScan, SearchesForLoopsThatAKillPrevented) {
  Strokes whole;
  whole.stroke(0, 0, 0);
  whole.stroke(0.8, 0.6, 50);
  whole.stroke(1.5, -0.5, -30);
  const SlamMap map = whole.finish();
  ASSERT_EQ(map.components, 1);
  ScanRecord killed = map;
  for (std::size_t id = 1; id < killed.searched.size(); ++id) killed.searched[id] = false;
  std::erase_if(killed.edges, [](const PoseGraphEdge& edge) { return edge.kind == EdgeKind::loop; });
  expect_same_map(Strokes(killed).finish(), map);
}

TEST(ContinuedScan, SaysWhichPartsJoined) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  scan.stroke(0.8, 0.6, 50);
  scan.stroke(40, 0, 0);
  SlamMap map = scan.finish();
  EXPECT_TRUE(describe_parts(map).empty());
  map.parts = {{0, "a", 1, "/a.mkv"}, {9, "b", 1, ""}, {18, "c", 1, "/c.mkv"}, {27, "d", 1, "/d.mkv"}};
  EXPECT_THAT(
      describe_parts(map),
      testing::ElementsAre("part 1 of 4 (/a.mkv): joined, 3 frames", "part 2 of 4 (b): joined, 3 frames",
                           "part 3 of 4 (/c.mkv): did not join: no place of it was recognized in the map",
                           "part 4 of 4 (/d.mkv): never touched"));
}

/// An older version of the program removed the only trial again, and then it was killed.
TEST(ContinuedScan, MayHoldNoKeyframeAnyMore) {
  const TemporaryFolder folder;
  Strokes scan;
  scan.stroke(0, 0, 0);
  write_store(folder.path(), scan.finish());
  sql(folder / "session.db",
      "UPDATE keyframes SET surface=NULL; UPDATE frames SET status='undone', keyframe=NULL");
  const ScanRecord undone = read_scan(folder.path(), {});
  const SlamMap map = Strokes(undone).finish();
  EXPECT_EQ(map.components, 0);
  fs::create_directory(folder / "run");
  write_run(folder / "run", {Config{}, map, fuse_map(map, FusionOptions{}), {}});
  EXPECT_EQ(read_bytes(folder / "run/trajectory.tum"), "");
  Strokes again(undone);
  again.stroke(0, 0, 0);
  EXPECT_EQ(again.finish().components, 1);
}

}  // namespace
}  // namespace gelslam::test
