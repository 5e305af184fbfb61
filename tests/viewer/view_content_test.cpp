#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gelslam/viewer/view_window.hpp"
#include "temporary_folder.hpp"
#include "view_run.hpp"

namespace gelslam::test {
namespace {

using testing::HasSubstr;

TEST(ViewContent, LoopsThatHaveNoSayAreMarked) {
  const TemporaryFolder folder;
  write_run(folder / "RUN", 5, /*loop_is_outlier=*/true);
  const RunHistory history = *load_view(folder / "RUN").history;
  ASSERT_EQ(history.session.edges.size(), 5U);
  for (const MapSnapshot::Edge& edge : history.session.edges) {
    EXPECT_EQ(edge.outlier, edge.from == 0 && edge.to == 8);
    EXPECT_EQ(edge.kind, edge.outlier ? EdgeKind::loop : EdgeKind::odometry);
  }
}

TEST(ViewContent, ATimeShowsWhatWasThereThen) {
  const TemporaryFolder folder;
  write_run(folder / "RUN", 5);
  const RunHistory history = *load_view(folder / "RUN").history;
  EXPECT_TRUE(history.map_at(-0.1).nodes.empty());
  EXPECT_TRUE(history.trajectory_at(-0.1).empty());
  EXPECT_EQ(history.map_at(0).nodes.size(), 1U);
  const MapSnapshot map = history.map_at(2.5);
  ASSERT_EQ(map.nodes.size(), 3U);
  EXPECT_EQ(map.nodes.back().keyframe, 4);
  EXPECT_DOUBLE_EQ(map.nodes.back().component_T_keyframe.translation().x(), 3.0);
  EXPECT_EQ(map.edges.size(), 2U) << "the loop to the last keyframe was not there yet";
  EXPECT_EQ(history.map_at(100).edges.size(), 5U);
  const auto way = history.trajectory_at(2.5);
  ASSERT_EQ(way.size(), 1U);
  EXPECT_EQ(way[0].size(), 26U);  // 0, 0.1 … 2.5
  EXPECT_NEAR(way[0].back().translation().x(), 3.75, 1e-6) << "millimeters";
}

TEST(ViewContent, LostTrackCutsTheTrajectory) {
  RunHistory history;
  for (const double t : {0.0, 0.04, 0.08, 1.0, 1.04}) history.trajectory.push_back({t, Pose::Identity()});
  const auto pieces = history.trajectory_at(2);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_EQ(pieces[0].size(), 3U);
  EXPECT_EQ(pieces[1].size(), 2U);
}

TEST(ViewContent, MistakesAreNamed) {
  const TemporaryFolder folder;
  const auto message = [&](const std::filesystem::path& path) {
    return message_of([&] { load_view(path); });
  };
  EXPECT_THAT(message(folder / "nowhere"), HasSubstr("no such file or folder"));
  EXPECT_THAT(message(folder.path()), HasSubstr("is no run folder"));
  write_run(folder / "RUN", 3);
  write_bytes(folder / "RUN" / "keyframes.tum", "0 0 0 0 0 0 0 1\n");
  EXPECT_THAT(message(folder / "RUN"), HasSubstr("keyframes.tum lists 1 keyframes, session.db 3"));
  write_run(folder / "RUN", 3);
  write_bytes(folder / "RUN" / "mesh.ply", "ply\nformat ascii 1.0\nelement vertex 999999999\n");
  EXPECT_THAT(message(folder / "RUN"), HasSubstr("mesh.ply"));
  write_bytes(folder / "no.ply", "");
  EXPECT_THAT(message_of([&] { load_truth(folder.path(), folder / "RUN"); }),
              HasSubstr("true_start_T_currs"));
}

}  // namespace
}  // namespace gelslam::test
