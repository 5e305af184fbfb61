#include "gelslam/slam/merge_scans.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "../support/database.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/store.hpp"
#include "run_folder/run_writer.hpp"
#include "strokes.hpp"

namespace gelslam::test {
namespace {

class Merge : public testing::Test {
 protected:
  struct TwoThatOverlap : Strokes {
    TwoThatOverlap() {
      stroke(0, 0, 0);
      stroke(0.8, 0.6, 50);
    }
  };
  /// Saves these strokes as a run folder.
  void save(const char* name, const Strokes& scan) {
    const SlamMap map = scan.finish();
    fs::create_directory(folder / name);
    write_run(folder / name, {Config{}, map, fuse_map(map, FusionOptions{}), {}});
    for (const auto& [frame, pose] : scan.truth()) truth[frames + frame] = pose;
    frames += map.frames.back().frame + 1;
  }
  RunReport merge(const std::vector<std::string>& names) {
    MergeRequest request{{}, folder / "merged", false};
    for (const std::string& name : names) request.runs.push_back(folder / name);
    NoProgress progress;
    return merge_scans(request, progress, [] { return false; }).report;
  }
  /// Expects that every keyframe of the merged map has its true pose relative to the first.
  void expect_true(double mm, double deg) {
    const std::vector<PosedSurface> patches = posed_surfaces(load_saved_map(folder / "merged"));
    const ScanRecord record = read_scan(folder / "merged", {});
    const auto frame_of = [&](int id) { return record.keyframes[static_cast<std::size_t>(id)]->frame; };
    ASSERT_GE(patches.size(), 4u);
    ASSERT_EQ(patches.size(), record.keyframes.size());
    for (const PosedSurface& patch : patches) {
      const PosedSurface& first = patches.front();
      const PoseGap error = gap(first.map_T_keyframe.inverse() * patch.map_T_keyframe,
                                truth.at(frame_of(first.id)).inverse() * truth.at(frame_of(patch.id)));
      EXPECT_LT(error.mm, mm) << patch.id;
      EXPECT_LT(error.deg, deg) << patch.id;
    }
  }

  TemporaryFolder folder;
  std::map<std::int64_t, Pose> truth;
  std::int64_t frames = 0;
};

TEST_F(Merge, JoinsTwoHalvesOfAScan) {
  const TwoThatOverlap left;
  Strokes right;
  right.stroke(1.5, -0.5, -30);
  right.stroke(2.5, 0.1, 10);
  save("left", left);
  save("right", right);
  const RunReport summary = merge({"left", "right"});
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.trials, 4);
  ASSERT_EQ(summary.parts.size(), 2u);
  EXPECT_THAT(summary.parts[1], HasSubstr("right): joined, 6 frames"));
  expect_true(0.04, 0.1);
  EXPECT_GT(read_mesh(folder / "merged/mesh.ply").triangles.size(), 1000u);
}

/// One run was made with another model, and one with pictures of another size.
TEST_F(Merge, RefusesScansOfDifferentSensorsOrModels) {
  View small;
  small.width_px = 256;
  small.height_px = 192;
  Strokes left, other_pictures({}, small);
  left.stroke(0, 0, 0);
  other_pictures.stroke(0.8, 0.6, 50);
  save("left", left);
  save("small", other_pictures);
  save("model", left);
  sql(folder / "model/session.db", "UPDATE parts SET model_crc32=6");
  for (const auto& [names, words] : {std::pair(std::vector<std::string>{"left", "model"},
                                               "model: was scanned with another gradient model; "),
                                     {{"left", "small"}, "small: was scanned at 256x192 pixels"},
                                     {{"small", "left"}, "small: was scanned at 256x192 pixels"}})
    EXPECT_THAT(
        message_of([&] { merge(names); }),
        testing::AllOf(HasSubstr(words), HasSubstr("; scans of different sensors or models stay apart")));
  EXPECT_FALSE(fs::exists(folder / "merged"));
}

TEST_F(Merge, SaysWhatDidNotJoin) {
  const TwoThatOverlap left;
  Strokes right;
  right.stroke(40, 0, 0);
  save("left", left);
  save("right", right);
  const RunReport summary = merge({"left", "right"});
  EXPECT_EQ(summary.components, 2);
  EXPECT_THAT(summary.parts[1], HasSubstr("right): did not join"));
  EXPECT_THAT(message_of([&] { merge({"left"}); }), HasSubstr("at least two"));
  for (const char* again : {"left", "right/../left", "left/"})
    EXPECT_THAT(message_of([&] { merge({"left", again}); }), HasSubstr("is given twice"));
}

TEST_F(Merge, FindsTheLoopsThatAnAbortedScanDidNotSearchFor) {
  Strokes elsewhere;
  elsewhere.stroke(20, 0, 0);
  save("aborted", TwoThatOverlap());
  save("elsewhere", elsewhere);
  for (const char* lost : {"DELETE FROM edges WHERE kind = 'loop'", "DELETE FROM searched"})
    sql(folder / "aborted/session.db", lost);
  EXPECT_EQ(merge({"aborted", "elsewhere"}).components, 2);
}

/// A run with two strokes, whose mesh is fused anew.
class Fuse : public Merge {
 protected:
  Fuse() {
    scan.stroke(0, 0, 0);
    scan.stroke(0.4, 0.3, 25);
    save("run", scan);
    request.run = folder / "run";
    mesh = read_bytes(request.run / "mesh.ply");
  }
  FuseSummary fuse() {
    NoProgress progress;
    return fuse_run(request, progress, [] { return false; });
  }
  std::string refusal() {
    const std::string message = message_of([&] { fuse(); });
    EXPECT_TRUE(read_bytes(request.run / "mesh.ply") == mesh) << "the run stays as it is";
    return message;
  }
  /// Continues the scan without saving it, like a live scan that is then killed.
  void go_on_without_saving() {
    const SlamMap before = scan.finish();
    scan.stroke(0.8, 0.6, 50);
    const SlamMap after = scan.finish();
    Store store(request.run);
    for (std::size_t i = before.frames.size(); i < after.frames.size(); ++i) store.add(after.frames[i]);
    for (std::size_t id = before.keyframes.size(); id < after.keyframes.size(); ++id)
      store.add({after.keyframes[id], {}});
    store.flush();
  }

  Strokes scan;
  FuseRequest request;
  std::string mesh;
};

TEST_F(Fuse, UsesOtherSettingsWhereTheyAreGiven) {
  const std::size_t before = read_mesh(folder / "run/mesh.ply").triangles.size();
  request.output = folder / "coarse";
  request.voxel_size_mm = 0.16;
  const FuseSummary coarse = fuse();
  EXPECT_EQ(read_mesh(folder / "coarse/mesh.ply").triangles.size(), coarse.mesh.triangles);
  EXPECT_NEAR(static_cast<double>(coarse.mesh.triangles), static_cast<double>(before) / 4,
              0.1 * static_cast<double>(before));
  EXPECT_EQ(read_mesh(folder / "run/mesh.ply").triangles.size(), before) << "the run stays as it is";
  EXPECT_EQ(read_config(folder / "coarse/config.yaml").slam.fusion.voxel_size_mm, 0.16);
  // With the settings of the run it is the same mesh.
  request.output = folder / "same";
  request.voxel_size_mm.reset();
  const double in_mesh_cm2 =
      touched_surface(snapshot_of(scan.finish()), read_mesh(folder / "run/mesh.ply"), {}).in_mesh_cm2;
  EXPECT_GT(in_mesh_cm2, 0.1);
  EXPECT_NEAR(fuse().touched.in_mesh_cm2, in_mesh_cm2, 0.01 * in_mesh_cm2);
  EXPECT_TRUE(read_bytes(folder / "same/mesh.ply") == read_bytes(folder / "run/mesh.ply"));
  write_bytes(folder / "same/.tmp-12-0-mesh.ply", "");  // a fuse in place was killed
  request.overwrite = true;
  EXPECT_EQ(fuse().keyframes, coarse.keyframes);
  // A killed scan has a record, but no map.
  sql(folder / "run/session.db", "DELETE FROM map");
  request.output.clear();
  EXPECT_TRUE(fuse().map_was_made);
  EXPECT_TRUE(read_bytes(folder / "same/mesh.ply") == read_bytes(folder / "run/mesh.ply"));
  EXPECT_FALSE(load_saved_map(folder / "run").nodes.empty());
  request.voxel_size_mm = 0.6;
  request.truncation_mm = 1.0;
  EXPECT_THAT(refusal(), HasSubstr("at least twice the voxel size"));
}

TEST_F(Fuse, AMapThatIsOlderThanItsScanIsMadeAgain) {
  EXPECT_FALSE(fuse().map_was_made);
  const std::size_t before = load_saved_map(request.run).nodes.size();
  go_on_without_saving();
  EXPECT_THAT(load_saved_map(request.run).warning, HasSubstr("went on after"));
  EXPECT_TRUE(fuse().map_was_made);
  EXPECT_GT(load_saved_map(request.run).nodes.size(), before);
  EXPECT_EQ(load_saved_map(request.run).warning, "");
  EXPECT_GT(read_bytes(request.run / "mesh.ply").size(), mesh.size());
  EXPECT_FALSE(fuse().map_was_made);
}

TEST_F(Fuse, ThatCannotWriteTheSessionChangesNothing) {
  go_on_without_saving();
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open((request.run / "session.db").c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
  EXPECT_THAT(refusal(), HasSubstr("session.db: another program is using it"));
  sqlite3_close(other);
  check_is_run(request.run);
  EXPECT_TRUE(fuse().map_was_made);
}

// A session cannot state which keyframes have not been compared with those of other runs. If a merge that was
// stopped was saved, it would be continued as if all had been compared.
TEST_F(Merge, ThatIsStoppedWritesNothing) {
  save("one", TwoThatOverlap());
  save("two", TwoThatOverlap());
  NoProgress progress;
  EXPECT_THROW(merge_scans({{folder / "one", folder / "two"}, folder / "merged", false}, progress,
                           [] { return true; }),
               Error);
  EXPECT_FALSE(fs::exists(folder / "merged"));
}

/// A folder in place of the mesh stops the replacement between two files, as if the program had been killed
/// there.
TEST_F(Fuse, MeshAndConfigurationAreReplacedAsAWhole) {
  request.voxel_size_mm = 0.16;
  fs::remove(request.run / "mesh.ply");
  fs::create_directories(request.run / "mesh.ply/in the way");
  EXPECT_THAT(message_of([&] { fuse(); }), HasSubstr("run/mesh.ply: cannot be written"));
  fs::remove_all(request.run / "mesh.ply");
  for (const auto& read : {std::function<void()>([&] { load_saved_map(request.run); }),
                           std::function<void()>([&] { check_is_run(request.run); })})
    EXPECT_THAT(message_of(read), HasSubstr("the scan was not finished; fuse the run to make its map"));
  EXPECT_TRUE(fuse().map_was_made);
  EXPECT_EQ(load_saved_map(request.run).warning, "");
  EXPECT_EQ(read_config(request.run / "config.yaml").slam.fusion.voxel_size_mm, 0.16);
  const std::string next = read_bytes(request.run / "mesh.ply");
  EXPECT_LT(next.size(), mesh.size());
  EXPECT_FALSE(fuse().map_was_made);
  EXPECT_TRUE(read_bytes(request.run / "mesh.ply") == next);
}

}  // namespace
}  // namespace gelslam::test
