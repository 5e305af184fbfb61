#include "gelslam/slam/continue_scan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "gelslam/slam/session.hpp"
#include "gelslam/surface/resampling.hpp"
#include "run_folder/run_writer.hpp"
#include "run_folder/scan_writer.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

const Field& ground() {
  static const Field field = textured_plane(1);
  return field;
}

Pose stroke_pose(double x_mm, double y_mm, double twist_deg, int step) {
  if (step < 0) return motion(0, 0, 0, 0, 0, -3);  // lifted
  return motion(0.5 * step, 0, twist_deg, x_mm + 0.3 * step, y_mm - 0.2 * step, 0.4);
}

/// Of all tests here: the same touches come again and again, and each takes a tenth of a second to make.
SurfacePtr touched(double x_mm, double y_mm, double twist_deg, int step, const View& view) {
  static std::map<std::tuple<double, double, double, int, int>, SurfacePtr> made;
  SurfacePtr& surface = made[{x_mm, y_mm, twist_deg, step, view.width_px}];
  if (!surface) surface = touch(ground(), stroke_pose(x_mm, y_mm, twist_deg, step), view);
  return surface;
}

/// Strokes over a textured plane.
class Strokes {
 public:
  explicit Strokes(const ContinuedScan* continued = nullptr, const View& view = View())
      : view_(view), slam_(SlamOptions{}, continued), next_(continued ? continued->first_frame : 0) {}

  void stroke(double x_mm, double y_mm, double twist_deg) {
    for (int step = 0; step < 3; ++step) {
      truth_[next_] = stroke_pose(x_mm, y_mm, twist_deg, step);
      see(touched(x_mm, y_mm, twist_deg, step, view_));
    }
    see(touched(0, 0, 0, -1, view_));
  }
  SlamMap finish(const ScanPart& part = {}) const {
    SlamMap map = slam_.finish();
    if (map.measured.parts.empty()) map.measured.parts = {part};
    return map;
  }
  const std::map<std::int64_t, Pose>& truth() const { return truth_; }

 private:
  void see(const SurfacePtr& surface) {
    slam_.process(next_, 0.04 * static_cast<double>(next_), surface, timer_);
    ++next_;
  }

  View view_;
  GelSlam slam_;
  StageTimer timer_;
  std::int64_t next_;
  std::map<std::int64_t, Pose> truth_;
};

ContinuedScan read_back(const std::filesystem::path& folder) {
  ContinuedScan scan;
  scan.record = read_scan(folder, NormalFlowOptions{});
  scan.first_frame = scan.record.frames.back().frame + 1;
  return scan;
}

/// To the last bit: keyframes are what their files hold from the moment they are made.
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
  save_session(folder / "session", first.finish());
  const ContinuedScan continued = read_back(folder / "session");
  Strokes second(&continued);
  for (Strokes* scan : {&whole, &second}) {
    scan->stroke(1.5, -0.5, -30);
    scan->stroke(2.5, 0.1, 10);
  }
  const SlamMap map = second.finish();
  EXPECT_EQ(map.components, 1);
  EXPECT_EQ(map.trials, 4);
  expect_same_map(map, whole.finish());
}

/// As after a kill: the loops of the last keyframes were not looked for yet.
TEST(ContinuedScan, SearchesForLoopsThatAKillPrevented) {
  Strokes whole;
  whole.stroke(0, 0, 0);
  whole.stroke(0.8, 0.6, 50);
  whole.stroke(1.5, -0.5, -30);
  const SlamMap map = whole.finish();
  ASSERT_EQ(map.components, 1);
  ContinuedScan killed;
  killed.record = map.measured;
  for (std::size_t id = 1; id < killed.record.searched.size(); ++id) killed.record.searched[id] = false;
  std::erase_if(killed.record.edges, [](const PoseGraphEdge& edge) { return edge.kind == EdgeKind::loop; });
  expect_same_map(Strokes(&killed).finish(), map);
}

TEST(ContinuedScan, SaysWhichPartsJoined) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  scan.stroke(0.8, 0.6, 50);
  scan.stroke(40, 0, 0);
  SlamMap map = scan.finish();
  EXPECT_TRUE(describe_parts(map).empty());
  map.measured.parts = {
      {0, "a", 1, "/a.mkv"}, {4, "b", 1, ""}, {8, "c", 1, "/c.mkv"}, {12, "d", 1, "/d.mkv"}};
  EXPECT_THAT(
      describe_parts(map),
      testing::ElementsAre("part 1 of 4 (/a.mkv): joined, 3 frames", "part 2 of 4 (b): joined, 3 frames",
                           "part 3 of 4 (/c.mkv): did not join: no place of it was recognized in the map",
                           "part 4 of 4 (/d.mkv): never touched"));
}

TEST(ContinuedScan, OfAnotherSensorIsRefused) {
  const TemporaryFolder folder;
  Strokes scan;
  scan.stroke(0, 0, 0);
  save_session(folder / "run/session", scan.finish());
  Config config;
  EXPECT_EQ(continue_scan(folder / "run", config, "").first_frame, 4);
  config.sensor.pixel_pitch_mm = 0.05;
  EXPECT_THAT(message_of<Error>([&] { continue_scan(folder / "run", config, ""); }),
              HasSubstr("was scanned at 320x240 pixels of 0.0634 mm, not at 320x240 pixels of 0.05 mm; "
                        "reconstruct the new log alone"));
  EXPECT_THAT(message_of<Error>([&] { continue_scan(folder / "nothing", config, ""); }),
              HasSubstr("no such run folder"));
  save_session(folder / "run/session", scan.finish({0, "sensor", 77, ""}));
  EXPECT_THAT(message_of<Error>([&] { continue_scan(folder / "run", Config{}, ""); }),
              HasSubstr("another gradient model"));
}

/// Its line was damaged.
TEST(ContinuedScan, WithoutItsPartIsOfAnUnknownSensor) {
  const TemporaryFolder folder;
  Strokes scan;
  scan.stroke(0, 0, 0);
  SlamMap map = scan.finish();
  map.measured.parts.clear();
  save_session(folder / "run/session", map);
  EXPECT_THAT(read_back(folder / "run/session").record.warnings,
              testing::ElementsAre(HasSubstr("does not say which sensor and model")));
  EXPECT_THAT(message_of<Error>([&] { continue_scan(folder / "run", Config{}, ""); }),
              HasSubstr("does not say by which gradient model it was scanned"));
}

class Merge : public testing::Test {
 protected:
  /// A run folder of these strokes; returns where its anchor was.
  void save(const char* name, const Strokes& scan, const Config& config, const ScanPart& part) {
    const SlamMap map = scan.finish(part);
    std::filesystem::create_directory(folder / name);
    write_run(folder / name, config, map, fuse_map(map, config.slam.fusion), {});
    first_frame[name] = frames;
    for (const auto& [frame, pose] : scan.truth()) truth[frames + frame] = pose;
    frames += map.frames.back().frame + 1;
  }
  ReconstructSummary merge(std::vector<std::string> names, const char* output = "merged",
                           bool overwrite = false) {
    MergeRequest request{{}, folder / output, overwrite};
    for (const std::string& name : names) request.runs.push_back(folder / name);
    NoProgress progress;
    return merge_scans(request, progress, [] { return false; });
  }
  /// Every keyframe of the merged map lies where the truth has it, seen from the first.
  void expect_true(double mm, double deg) {
    const SavedMap map = load_map(folder / "merged/session");
    const ScanRecord record = read_scan(folder / "merged/session", {});
    const auto frame_of = [&](int id) { return record.keyframes[static_cast<std::size_t>(id)]->frame; };
    ASSERT_GE(map.nodes.size(), 4u);
    for (const SavedMap::Node& node : map.nodes) {
      ASSERT_TRUE(node.in_map);
      const SavedMap::Node& first = map.nodes.front();
      const PoseGap error =
          gap(first.component_T_keyframe.inverse() * node.component_T_keyframe,
              truth.at(frame_of(first.keyframe)).inverse() * truth.at(frame_of(node.keyframe)));
      EXPECT_LT(error.mm, mm) << node.keyframe;
      EXPECT_LT(error.deg, deg) << node.keyframe;
    }
  }

  TemporaryFolder folder;
  std::map<std::string, std::int64_t> first_frame;
  std::map<std::int64_t, Pose> truth;
  std::int64_t frames = 0;
};

TEST_F(Merge, JoinsTwoHalvesOfAScan) {
  Strokes left, right;
  left.stroke(0, 0, 0);
  left.stroke(0.8, 0.6, 50);
  right.stroke(1.5, -0.5, -30);
  right.stroke(2.5, 0.1, 10);
  save("left", left, Config{}, {0, "one", 5, ""});
  save("right", right, Config{}, {0, "one", 5, ""});
  const ReconstructSummary summary = merge({"left", "right"});
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.trials, 4);
  ASSERT_EQ(summary.parts.size(), 2u);
  EXPECT_THAT(summary.parts[1], HasSubstr("right): joined, 6 frames"));
  expect_true(0.04, 0.1);
  EXPECT_GT(read_mesh(folder / "merged/mesh.ply").triangles.size(), 1000u);
}

TEST_F(Merge, JoinsScansOfTwoSensorsAndTheirMergeWithAThird) {
  View fine;
  fine.pixel_pitch_mm = 0.0634 * 0.8;  // at this pitch the surfaces of the others have 400x300 pixels
  fine.contact_width_px /= 0.8;
  fine.contact_height_px /= 0.8;
  Config fine_config;
  fine_config.sensor.pixel_pitch_mm = fine.pixel_pitch_mm;
  Strokes left, right(nullptr, fine), more;
  left.stroke(0.8, 0.6, 50);
  right.stroke(1.5, -0.5, -30);
  right.stroke(2.5, 0.1, 10);
  more.stroke(0, 0, 0);
  save("right", right, fine_config, {0, "two", 6, ""});
  save("left", left, Config{}, {0, "one", 5, ""});
  save("more", more, Config{}, {0, "one", 5, ""});
  EXPECT_EQ(merge({"right", "left"}).components, 1);
  expect_true(0.08, 0.2);
  std::filesystem::rename(folder / "merged", folder / "both");  // holds surfaces of two sizes
  EXPECT_EQ(merge({"both", "more"}).components, 1);
  expect_true(0.08, 0.2);
}

/// With the edges of the run's own map, which may still name it.
TEST_F(Merge, LeavesOutADamagedSurface) {
  Strokes left, right;
  left.stroke(0, 0, 0);
  left.stroke(0.8, 0.6, 50);
  right.stroke(1.5, -0.5, -30);
  save("left", left, Config{}, {0, "one", 5, ""});
  save("right", right, Config{}, {0, "two", 6, ""});
  SlamMap map = left.finish({0, "one", 5, ""});
  map.surfaces_corrected = true;
  save_session(folder / "left/session", map);
  const int damaged = map.edges.front().to;
  write_bytes(folder / "left/session" / (std::to_string(damaged) + ".surface"), "nothing");
  const ReconstructSummary summary = merge({"left", "right"});
  EXPECT_THAT(summary.warning, HasSubstr("1 keyframe of"));
  for (const SavedMap::Node& node : load_map(folder / "merged/session").nodes)
    EXPECT_NE(node.keyframe, damaged);
}

TEST_F(Merge, SaysWhatDidNotJoin) {
  Strokes left, right;
  left.stroke(0, 0, 0);
  left.stroke(0.8, 0.6, 50);
  right.stroke(40, 0, 0);
  save("left", left, Config{}, {0, "one", 5, ""});
  save("right", right, Config{}, {0, "one", 5, ""});
  const ReconstructSummary summary = merge({"left", "right"});
  EXPECT_EQ(summary.components, 2);
  EXPECT_THAT(summary.parts[1], HasSubstr("right): did not join"));
  EXPECT_THAT(message_of<Error>([&] { merge({"left"}); }), HasSubstr("at least two"));
}

/// Their logs would be lost.
TEST_F(Merge, ReplacesNoRunThatItReads) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  for (const char* name : {"left", "right"}) save(name, scan, Config{}, {0, "one", 5, ""});
  for (const char* name : {"left", "right"}) {
    write_bytes(folder / name / "log.mkv", "pictures");
    EXPECT_THAT(message_of<Error>([&] {
                  merge({"left", "right"}, name, true);
                }),
                HasSubstr("for it holds the input"));
    EXPECT_EQ(read_bytes(folder / name / "log.mkv"), "pictures");
  }
}

TEST_F(Merge, FusesAgainWithOtherSettings) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  save("run", scan, Config{}, {});
  const std::size_t before = read_mesh(folder / "run/mesh.ply").triangles.size();
  FuseRequest request;
  request.run = folder / "run";
  request.output = folder / "coarse";
  request.voxel_size_mm = 0.16;
  NoProgress progress;
  const FuseSummary coarse = fuse_run(request, progress, [] { return false; });
  EXPECT_EQ(read_mesh(folder / "coarse/mesh.ply").triangles.size(), coarse.triangles);
  EXPECT_NEAR(static_cast<double>(coarse.triangles), static_cast<double>(before) / 4,
              0.1 * static_cast<double>(before));
  EXPECT_EQ(read_mesh(folder / "run/mesh.ply").triangles.size(), before) << "the run stays as it is";
  EXPECT_EQ(read_config(folder / "coarse/config.yaml").slam.fusion.voxel_size_mm, 0.16);
  // With the settings of the run it is the same mesh.
  request.output = folder / "same";
  request.voxel_size_mm.reset();
  fuse_run(request, progress, [] { return false; });
  EXPECT_TRUE(read_bytes(folder / "same/mesh.ply") == read_bytes(folder / "run/mesh.ply"));
  write_bytes(folder / "same/.tmp-12-0-mesh.ply", "");  // a fuse in place was killed
  request.overwrite = true;
  EXPECT_EQ(fuse_run(request, progress, [] { return false; }).keyframes, coarse.keyframes);
  // A killed scan has a record, but no map.
  std::filesystem::remove(folder / "run/session/session.json");
  request.output.clear();
  EXPECT_TRUE(fuse_run(request, progress, [] { return false; }).map_was_made);
  EXPECT_TRUE(read_bytes(folder / "same/mesh.ply") == read_bytes(folder / "run/mesh.ply"));
  EXPECT_FALSE(load_session(folder / "run/session").patches.empty());
  request.voxel_size_mm = 0.6;
  EXPECT_THAT(message_of<Error>([&] { fuse_run(request, progress, [] { return false; }); }),
              HasSubstr("at least twice the voxel size"));
}

/// A run of one stroke, and what happens to it.
class Fuse : public Merge {
 protected:
  Fuse() {
    scan.stroke(0, 0, 0);
    save("run", scan, Config{}, {});
    request.run = folder / "run";
    mesh = read_bytes(request.run / "mesh.ply");
  }
  FuseSummary fuse(bool stop = false) {
    NoProgress progress;
    return fuse_run(request, progress, [stop] { return stop; });
  }
  std::string refusal(bool stop = false) {
    const std::string message = message_of<Error>([&] { fuse(stop); });
    EXPECT_TRUE(read_bytes(request.run / "mesh.ply") == mesh) << "the run stays as it is";
    return message;
  }
  /// As a live scan does that is killed then.
  void go_on_without_saving() {
    const SlamMap before = scan.finish();
    scan.stroke(0.8, 0.6, 50);
    const SlamMap after = scan.finish();
    ScanWriter writer = ScanWriter::append(session);
    for (std::size_t i = before.frames.size(); i < after.frames.size(); ++i)
      writer.add_frame(after.frames[i]);
    for (std::size_t id = before.keyframes.size(); id < after.keyframes.size(); ++id)
      writer.add_keyframe(*after.measured.keyframes[id], nullptr);
    writer.flush();
  }

  Strokes scan;
  FuseRequest request;
  std::string mesh;
  const std::filesystem::path session = folder / "run/session";
};

TEST_F(Fuse, AMapThatIsOlderThanItsScanIsMadeAgain) {
  EXPECT_FALSE(fuse().map_was_made);
  const std::size_t before = load_session(session).patches.size();
  go_on_without_saving();
  EXPECT_THAT(load_session(session).warnings, testing::ElementsAre(HasSubstr("went on after")));
  EXPECT_THAT(message_of<Error>([&] { load_map(session); }), HasSubstr("went on after"));
  EXPECT_TRUE(fuse().map_was_made);
  EXPECT_GT(load_session(session).patches.size(), before);
  EXPECT_TRUE(load_session(session).warnings.empty());
  EXPECT_GT(read_bytes(request.run / "mesh.ply").size(), mesh.size());
  EXPECT_FALSE(fuse().map_was_made);
}

TEST_F(Fuse, ReplacesNoMeshByALesserOne) {
  const std::string surface = read_bytes(session / "0.surface");
  ASSERT_GT(load_session(session).patches.size(), 1u);
  std::filesystem::remove(session / "0.surface");
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("0.surface: cannot be read"), HasSubstr("name a folder")));
  request.output = folder / "rest";
  EXPECT_EQ(fuse().warnings.size(), 1u);
  EXPECT_GT(read_mesh(folder / "rest/mesh.ply").triangles.size(), 100u);
  for (const auto& entry : std::filesystem::directory_iterator(session))
    if (entry.path().extension() == ".surface") std::filesystem::remove(entry);
  for (const char* output : {"", "none"}) {
    request.output = *output == 0 ? "" : folder / output;
    EXPECT_THAT(refusal(), HasSubstr("no keyframe"));
    std::filesystem::remove(session / "session.json");  // the second time as a scan that was killed
  }
  request.output.clear();
  EXPECT_THAT(refusal(), HasSubstr("no keyframe"));
  EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

TEST_F(Fuse, StoppedOnItsWayItChangesNothing) {
  std::filesystem::remove(session / "session.json");
  EXPECT_THAT(refusal(true), HasSubstr("stopped"));
  EXPECT_FALSE(std::filesystem::exists(session / "session.json"));
}

TEST_F(Fuse, TheReportSaysWhatCouldNotBeRead) {
  std::filesystem::remove(session / "session.json");
  std::filesystem::remove(request.run / "mesh.ply");  // nothing to lose
  std::filesystem::remove(session / "1.surface");
  EXPECT_EQ(fuse().warnings.size(), 1u);
  EXPECT_THAT(read_bytes(request.run / "report.json"), HasSubstr("1.surface: cannot be read"));
}

/// The only trial was taken back, then the scan was killed.
TEST(ContinuedScan, MayHoldNoKeyframeAnyMore) {
  const TemporaryFolder folder;
  Strokes scan;
  scan.stroke(0, 0, 0);
  save_session(folder / "run/session", scan.finish());
  ScanWriter::append(folder / "run/session").forget_from_trial(0);
  std::filesystem::remove(folder / "run/session/session.json");
  const ContinuedScan undone = read_back(folder / "run/session");
  const SlamMap map = Strokes(&undone).finish();
  EXPECT_EQ(map.components, 0);
  write_run(folder / "run", Config{}, map, fuse_map(map, FusionOptions{}), {});
  EXPECT_EQ(read_bytes(folder / "run/trajectory.tum"), "");
  Strokes again(&undone);
  again.stroke(0, 0, 0);
  EXPECT_EQ(again.finish().components, 1);
}

TEST(Resampled, ShowsTheSamePlaceAtAnotherPitch) {
  View fine;
  fine.pixel_pitch_mm = 0.04;
  fine.contact_width_px = fine.contact_height_px = 80;
  const Pose pose = motion(3, 4, 20, 0, 0, 0.4);
  const SurfacePtr seen = touch(ground(), pose, fine), same = resampled(*seen, 0.0634);
  EXPECT_EQ(same->pixel_pitch_mm, 0.0634);
  View coarse;
  coarse.width_px = same->contact.cols;
  coarse.height_px = same->contact.rows;
  coarse.contact_width_px = coarse.contact_height_px = 80 * 0.04 / 0.0634;
  const SurfacePtr truth = touch(ground(), pose, coarse);
  EXPECT_NEAR(same->contact_pixels, truth->contact_pixels, 0.02 * truth->contact_pixels);
  cv::Mat both;
  cv::bitwise_and(same->contact, truth->contact, both);
  cv::erode(both, both, cv::Mat(), {-1, -1}, 2);
  EXPECT_LT(cv::norm(same->height_mm, truth->height_mm, cv::NORM_INF, both), 0.003);
  EXPECT_LT(cv::norm(same->curvature, truth->curvature, cv::NORM_L2, both) /
                cv::norm(truth->curvature, cv::NORM_L2, both),
            0.2);
}

}  // namespace
}  // namespace gelslam
