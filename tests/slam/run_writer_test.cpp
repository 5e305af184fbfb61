#include "run_folder/run_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "../support/analytic_surface.hpp"
#include "../support/file_size_limit.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam::test {
namespace {

/// Returns a map of four successive keyframes with two loops, of which the second one is false.
SlamMap map_with_a_false_loop() {
  SlamMap map;
  map.trials = map.components = 1;
  View view;
  view.contact_width_px = view.contact_height_px = 20;
  for (int id = 0; id < 4; ++id) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id;
    keyframe->frame = id;
    keyframe->surface = SurfacePtr(touch(plane(), motion(0, 0, 0, 0, 0, 0), view));
    map.keyframes.push_back(keyframe);
    map.solution.component_T_node[id] = motion(0, 0, 0, id, 0);
    map.solution.component_of_node[id] = 0;
    map.in_map.push_back(true);
    map.frames.push_back(
        {.frame = id, .time_s = 0.04 * id, .status = TrackStatus::tracked, .trial = 0, .keyframe = id});
  }
  const auto add = [&](int from, int to, EdgeKind kind, bool outlier) {
    PoseGraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.kind = kind;
    map.solved_edges.push_back(edge);
    map.solution.edge_outlier.push_back(outlier);
  };
  for (int id = 0; id < 3; ++id) add(id, id + 1, EdgeKind::odometry, false);
  add(0, 2, EdgeKind::loop, false);
  add(1, 3, EdgeKind::loop, true);
  map.loops = 2;
  return map;
}

TEST(RunFolderFiles, LoopsThatAreContradictedAreNotInTheGraph) {
  const TemporaryFolder folder;
  write_run(folder.path(), {Config{}, map_with_a_false_loop(), {}, {}});
  const std::string graph = read_bytes(folder / "pose_graph.g2o"),
                    outliers = read_bytes(folder / "loop_outliers.g2o");
  EXPECT_THAT(graph, HasSubstr("EDGE_SE3:QUAT 0 2 "));
  EXPECT_THAT(graph, Not(HasSubstr("EDGE_SE3:QUAT 1 3 ")));
  EXPECT_THAT(outliers, testing::StartsWith("EDGE_SE3:QUAT 1 3 "));
  EXPECT_EQ(std::count(outliers.begin(), outliers.end(), '\n'), 1);
  EXPECT_THAT(run_entries(), testing::Contains("loop_outliers.g2o")) << "else the run cannot be replaced";
}

/// Returns the run in a folder with a scan that is continued.
slam::detail::GrowingRun resume(const fs::path& folder) {
  const ContinuedScan scan{{}, std::make_shared<const FolderLock>(folder)};
  return slam::detail::resume_run(folder, scan, "", false, Config{});
}

TEST(RunFolderFiles, TimesAreThoseOfTheClockIfEveryFrameKnowsIt) {
  constexpr std::int64_t kStartUs = 1764268461123457;
  SlamMap map = map_with_a_false_loop();
  for (FrameRecord& frame : map.frames) frame.unix_us = kStartUs + std::llround(1e6 * frame.time_s);
  EXPECT_EQ(map.start_unix_us(), kStartUs);
  EXPECT_EQ(std::llround(1e6 * map.trajectory()[2].time_s), kStartUs + 80'000);
  const TemporaryFolder folder;
  write_run(folder.path(), {Config{}, map, {}, {}});
  for (const char* name : {"trajectory.tum", "keyframes.tum"})
    EXPECT_THAT(read_bytes(folder / name), HasSubstr("\n1764268461.203457 ")) << name;

  // The times do not agree if, for example, the clock was set.
  map.frames[1].unix_us = map.frames[2].unix_us;
  EXPECT_FALSE(map.start_unix_us());
  EXPECT_EQ(map.trajectory()[2].time_s, 0.08);
  map.frames[1].unix_us = 0;
  EXPECT_EQ(map.trajectory()[2].time_s, 0.08);
}

/// If the session could not be written during the scan, it is written at the end. An existing session is
/// replaced only then.
TEST(GrowingRun, ASessionThatCannotBeWrittenAgainStays) {
  const TemporaryFolder folder;
  SlamMap map = map_with_a_false_loop();
  map.parts = {ScanPart{}};
  for (int i = 4; i < 200; ++i) map.frames.push_back({.frame = i, .time_s = 0.04 * i});
  write_run(folder.path(), {Config{}, map, {}, {}});
  const std::string session = read_bytes(folder / "session.db");
  const auto run = resume(folder.path());
  map.frames.push_back({.frame = 200, .time_s = 8});
  std::string message;
  {
    const FileSizeLimit limit(session.size() - 1);
    message = message_of([&] { run.save({Config{}, map, {}, {}}, "it is gone"); });
  }
  EXPECT_THAT(message, testing::AllOf(HasSubstr((folder / "session.db: cannot be written").string()),
                                      HasSubstr("; it is gone")));
  EXPECT_TRUE(read_bytes(folder / "session.db") == session);
  fs::create_directory(folder / "saving.tmp");
  write_bytes(folder / "saving.tmp/hand.avi", "pictures");
  EXPECT_THAT(message_of([&] {
                run.save({Config{}, map, {}, {}}, "it is gone");
              }),
              HasSubstr("saving.tmp/hand.avi: is not of this program"));
  EXPECT_EQ(read_bytes(folder / "saving.tmp/hand.avi"), "pictures");
  fs::remove(folder / "saving.tmp/hand.avi");
  run.save({Config{}, map, {}, {}}, "it is gone");
  EXPECT_EQ(read_scan(folder.path(), {}).frames.size(), 201u);
  EXPECT_EQ(load_saved_map(folder.path()).warning, "");
  EXPECT_FALSE(fs::exists(folder / "saving.tmp"));
}

/// During the scan, the file of the session is removed, or the disk is full for a while.
TEST(GrowingRun, WritesTheSessionAsSoonAsItCan) {
  SlamMap map = map_with_a_false_loop();
  map.parts = {ScanPart{}};
  for (const bool removed : {false, true}) {
    const TemporaryFolder folder;
    write_run(folder.path(), {Config{}, map, {}, {}});
    const auto run = resume(folder.path());
    SessionQueue measured{1};
    std::vector<std::string> said;
    std::string problem;
    const auto add = [&](int frames) {
      for (int i = 0; i < frames; ++i)
        measured.push_beyond_limit(
            [&, i](Store& store) { store.add({.frame = 100 + i, .time_s = 4 + 0.04 * i}); });
    };
    add(60);
    std::optional<FileSizeLimit> full;
    measured.push_beyond_limit(
        [&](Store&) { removed ? void(fs::remove(folder / "session.db")) : void(full.emplace(10'000)); });
    for (int id = 4; id < 40; ++id)
      measured.push_beyond_limit([&, id](Store& store) {
        auto keyframe = std::make_shared<Keyframe>(*map.keyframes[0]);
        keyframe->id = id;
        store.add(NewKeyframe{keyframe, {}});
      });
    measured.push_beyond_limit([&](Store&) { full.reset(); });
    measured.close();
    problem = run.write_session(measured, [&](const std::string& what) { said.push_back(what); });
    ASSERT_FALSE(said.empty());
    if (removed) {
      EXPECT_THAT(problem, HasSubstr("session.db: was removed; it is written again at the end"));
      run.save({Config{}, map, {}, {}}, problem);
      EXPECT_EQ(read_scan(folder.path(), {}).keyframes.size(), 4u);
    } else {
      EXPECT_THAT(said.front(), HasSubstr("session.db: cannot be written"));
      EXPECT_EQ(problem, "");
      const ScanRecord record = read_scan(folder.path(), {});
      EXPECT_EQ(record.frames.size(), 64u);
      EXPECT_EQ(record.keyframes.size(), 40u);
    }
  }
}

/// During the scan, the folder is moved away and another run takes its place.
TEST(GrowingRun, WritesIntoNoOtherRun) {
  const TemporaryFolder folder;
  SlamMap map = map_with_a_false_loop();
  const auto begin = [&](const char* name) {
    fs::create_directory(folder / name);
    write_run(folder / name, {Config{}, map, {}, {}});
  };
  begin("RUN");
  const auto run = resume(folder / "RUN");
  fs::rename(folder / "RUN", folder / "moved");
  begin("RUN");
  const std::string session = read_bytes(folder / "RUN/session.db"),
                    report = read_bytes(folder / "RUN/report.json");
  EXPECT_THAT(message_of([&] {
                run.save({Config{}, map, {}, {}}, "");
              }),
              HasSubstr("RUN: was moved or removed during the scan; fuse it where it is now"));
  EXPECT_EQ(read_bytes(folder / "RUN/report.json"), report);
  EXPECT_TRUE(read_bytes(folder / "RUN/session.db") == session);
}

/// Returns a map whose last keyframe is a separate trial that is not joined, with two tracked frames.
SlamMap map_of_two_pieces() {
  SlamMap map = map_with_a_false_loop();
  map.components = 2;
  map.in_map[3] = false;
  for (FrameRecord& frame : map.frames) frame.status = TrackStatus::tracked;
  map.frames.push_back({.frame = 4, .time_s = 0.16, .status = TrackStatus::tracked, .keyframe = 3});
  map.frames.push_back({.frame = 5, .time_s = 0.2, .status = TrackStatus::lost});
  // A lost frame that begins a trial has a keyframe.
  map.frames.push_back({.frame = 6, .time_s = 0.24, .status = TrackStatus::lost, .keyframe = 0});
  return map;
}

Run finished(const SlamMap& map) {
  StageTimer timer;
  return finish_scan(Config{}, map, {}, timer, std::chrono::steady_clock::now(), nullptr);
}

TEST(Report, SaysWhatIsNotInTheMesh) {
  const SlamMap map = map_of_two_pieces();
  const RunReport report = finished(map).report;
  EXPECT_FALSE(report.complete());
  EXPECT_EQ(report.frames.not_in_mesh, 2);
  EXPECT_EQ(report.frames.in_map + 2, report.frames.tracked);
  EXPECT_EQ(report.frames.in_map, std::ssize(map.trajectory())) << "one set of figures";
  EXPECT_THAT(
      report.result_warnings,
      testing::ElementsAre("1 component not joined; 2 frames not in the mesh; next time cross places "
                           "that you touched before",
                           "only 77 % of what was touched is in the mesh",
                           "2 of 7 touched frames are lost; move more slowly, and press a little deeper"));
}

/// The speed before the lost frames is that at the end of a press, or that of a hand that moves too fast.
TEST(Report, BlamesTheSpeedOfLostFramesOnlyWhereItWasHigher) {
  for (const double last_mm : {0.5, 3.0}) {
    SlamMap map = map_with_a_false_loop();
    map.frames.clear();
    for (const double at_mm : {0.0, 1.0, 2.0, 2.0 + last_mm}) {
      FrameRecord frame{.frame = std::ssize(map.frames), .status = TrackStatus::tracked, .keyframe = 0};
      frame.time_s = 0.04 * static_cast<double>(frame.frame);
      frame.keyframe_T_frame.translation().x() = at_mm;
      map.frames.push_back(frame);
    }
    map.frames.push_back({.frame = 4, .time_s = 0.16, .status = TrackStatus::lost});
    EXPECT_THAT(
        finished(map).report.result_warnings,
        testing::Contains(last_mm < 1 ? "1 of 5 touched frames are lost; press a little deeper"
                                      : "1 of 5 touched frames are lost, after motions of 75 mm/s and "
                                        "0 degrees/s; 25 mm/s and 0 degrees/s were followed (medians); "
                                        "move more slowly, and press a little deeper"));
  }
}

TEST(Report, SaysWhatToDoWhereMuchOfWhatWasTouchedIsNotInTheMesh) {
  const RunReport whole = finished(map_with_a_false_loop()).report;
  EXPECT_GT(whole.touched.in_mesh_cm2, 0.9 * whole.touched.area_cm2);
  Config config;
  config.slam.fusion.min_weight = 0.6;  // rims of contacts are left out widely
  StageTimer timer;
  const RunReport report =
      finish_scan(config, map_with_a_false_loop(), {}, timer, std::chrono::steady_clock::now(), nullptr)
          .report;
  EXPECT_LT(report.touched.in_mesh_cm2, 0.9 * report.touched.area_cm2);
  EXPECT_THAT(
      report.result_warnings.at(0),
      testing::MatchesRegex("only [0-9]+ % of what was touched is in the mesh; touch the missing places "
                            "again in the middle of the gel"));
}

TEST(Report, SaysHowFarPosesMayBeOff) {
  const TemporaryFolder folder;
  SlamMap map = map_with_a_false_loop();
  map.uncertainty.drift_mm = {2.5, 3, 0.12};
  map.uncertainty.not_observable = {{.motion = "rz", .first_frame = 1, .first_time_s = 0.04, .frames = 3}};
  write_run(folder.path(), finished(map));
  const RunReport report = *find_report(folder.path());
  EXPECT_EQ(report.uncertainty.drift_mm.amount, 2.5);
  EXPECT_EQ(report.uncertainty.drift_mm.frame, 3);
  EXPECT_EQ(report.uncertainty.not_observable.at(0).motion, "rz");
  EXPECT_EQ(report.uncertainty.not_observable.at(0).first_frame, 1);
  EXPECT_THAT(report.result_warnings,
              testing::ElementsAre("poses may be off by 2.5 mm: return to where you began, and press on "
                                   "texture"));
  const RunReport whole = finished(map_with_a_false_loop()).report;
  EXPECT_TRUE(whole.complete());
  EXPECT_TRUE(whole.result_warnings.empty());
}

/// The test sets all members, also those that most runs do not have.
TEST(Report, IsReadAsItWasWritten) {
  RunReport report = finished(map_of_two_pieces()).report;
  report.log = "a log";
  report.logs = {{"first.mkv", 0}, {"second.mkv", 12}};
  report.live = {25, 100, 1, 2, 3};
  report.saved = true;
  report.stages["tracking"] = {"tracking", 3, 1, 2, 3, 6};
  const std::string json = report_json(report);
  EXPECT_EQ(report_json(parse_report(json, "x")), json);
  std::string older = json;
  older.replace(older.find("result_warnings"), std::strlen("result_warnings"), "reservations");
  EXPECT_EQ(report_json(parse_report(older, "x")), json) << "by their older name";
  const RunReport again = parse_report(json, "x");
  EXPECT_EQ(again.logs.at(1).first_time_s, 12);
  EXPECT_EQ(again.live->damaged, 3);
}

}  // namespace
}  // namespace gelslam::test
