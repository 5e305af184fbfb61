#include "gelslam/evaluation/evaluation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <iomanip>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "test_meshes.hpp"

namespace gelslam::test {
namespace {

using nlohmann::json;

constexpr int kFrames = 40, kBackground = 10;

Pose motion(double rx, double ry, double rz, double x, double y, double z) {
  Vector6d xi;
  xi << rx, ry, rz, x, y, z;
  return se3_exp(xi);
}

const Pose kStart_T_object = motion(0.3, -0.2, 2.0, 4, 5, 6);

/// The sensor's true pose `index` frames after the background.
Pose true_pose(int index) {
  const double s = 0.05 * index;
  return motion(0.2 * s, -0.3 * s, 0.4 * s, s, -2 * s, 0.1 * s * s);
}

using Rows = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

Rows in_meters(Pose pose) {
  pose.translation() *= 1e-3;
  return pose.matrix();
}

std::vector<double> numbers_in_meters(int frames, int without_touch) {
  std::vector<double> numbers;
  for (int i = 0; i < frames; ++i) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const Rows rows = i < without_touch ? Rows::Constant(kNone) : in_meters(true_pose(i));
    numbers.insert(numbers.end(), rows.data(), rows.data() + 16);
  }
  return numbers;
}

/// A data folder and a run folder whose estimate is the truth, with the map frame at `anchor`.
struct Scene {
  TemporaryFolder data, run;
  json meta = {{"frames", kFrames + kBackground},
               {"background_frames", kBackground},
               {"fps", 25},
               {"start_T_object", json::array()}};

  Scene() {
    const Rows rows = in_meters(kStart_T_object);
    for (int i = 0; i < 4; ++i)
      meta["start_T_object"].push_back(std::vector(rows.data() + 4 * i, rows.data() + 4 * i + 4));
  }

  void write_truth(int frames = kFrames, int without_touch = 0) const {
    const std::vector<double> numbers = numbers_in_meters(frames, without_touch);
    write_npy(data / "true_start_T_currs.npy", {static_cast<std::size_t>(frames), 4, 4},
              std::span<const double>(numbers));
    write_bytes(data / "meta.json", meta.dump());
  }

  void write_run(int anchor, int first = 0, int last = kFrames - 1, double fps = 25.0) const {
    std::string lines;
    for (int i = first; i <= last; ++i)
      lines += tum_line((i + kBackground) / fps, true_pose(anchor).inverse() * true_pose(i));
    write_bytes(run / "trajectory.tum", lines);
    RunReport report = report_of(anchor + kBackground, kFrames + kBackground);
    report.trials = 2;
    report.components = 1;
    write_report(report);
  }

  static RunReport report_of(int anchor_frame, int frames) {
    RunReport report;
    report.anchor_frame = anchor_frame;
    report.frames.total = frames;
    report.mesh.triangles = 1;
    return report;
  }
  void write_report(const RunReport& report) const { write_bytes(run / "report.json", report_json(report)); }

  void write_meshes(int anchor) const {
    const Mesh object = height_field(-5, 5, -5, 5, 60, &bumps);
    write_mesh(data / "gt_mesh.ply", object);
    write_mesh(run / "mesh.ply", transformed(object, true_pose(anchor).inverse() * kStart_T_object));
    std::vector<float> touched;
    for (int i = 0; i < 100; ++i) {
      const double x = -4.0 + 0.08 * i;
      for (const double value : {x, 0.5 * x, bumps(x, 0.5 * x)})
        touched.push_back(static_cast<float>(1e-3 * value));
    }
    write_npy(data / "touched.npy", {100, 3}, std::span<const float>(touched));
  }

  Evaluation evaluated() const {
    const Comparison comparison = compare(run.path(), data.path());
    return evaluate(comparison, place_meshes(comparison));
  }
  std::string error() const {
    return message_of([&] { evaluated(); });
  }
};

TEST(Evaluate, ThePerfectRunIsPerfectWhateverItsAnchor) {
  for (const int anchor : {0, 17, kFrames - 1}) {
    Scene scene;
    scene.write_truth();
    scene.write_run(anchor);
    scene.write_meshes(anchor);
    const Evaluation evaluation = scene.evaluated();
    EXPECT_EQ(evaluation.reference_frame, kBackground);
    EXPECT_LT(evaluation.trajectory->mae_mm.norm() + evaluation.trajectory->mae_deg.norm(), 1e-6);
    EXPECT_EQ(evaluation.trajectory->compared_frames, kFrames);
    ASSERT_TRUE(evaluation.mesh.has_value());
    EXPECT_LT(evaluation.mesh->at_known_pose.accuracy.mean_mm, 1e-4);
    EXPECT_LT(evaluation.mesh->at_known_pose.completeness.mean_mm,
              0.01);  // points on the curve, not its facets
    EXPECT_TRUE(evaluation.mesh->touched_only);
    EXPECT_LT(evaluation.mesh->refinement.shift_mm, 1e-3);
    EXPECT_EQ(evaluation.trials, 2);
    EXPECT_EQ(evaluation.components, 1);
  }
}

/// A run's mesh that has half of what was touched, and a square millimeter that was not.
TEST(Evaluate, SaysFirstHowMuchOfTheTouchedSurfaceIsInTheMesh) {
  const Mesh truth = height_field(-5, 5, -5, 5, 100, &bumps);
  const Mesh half = height_field(-5, 0, -5, 5, 100, &bumps),
             beside = height_field(0, 1, 0, 1, 10, [](double, double) { return 4; });
  Scene scene;
  scene.write_truth();
  scene.write_run(3);
  scene.write_meshes(3);
  std::vector<float> touched;
  for (const Eigen::Vector3f& vertex : truth.vertices_mm)
    for (const float coordinate : vertex) touched.push_back(1e-3F * coordinate);
  write_npy(scene.data / "touched.npy", {touched.size() / 3, 3}, std::span<const float>(touched));
  write_mesh(scene.data / "gt_mesh.ply", truth);
  write_mesh(scene.run / "mesh.ply",
             transformed(joined(half, beside), true_pose(3).inverse() * kStart_T_object));
  const Evaluation evaluation = scene.evaluated();
  EXPECT_NEAR(evaluation.mesh->area_mm2, area_mm2(truth), 1);
  // 0.25 mm beyond the border are near enough.
  EXPECT_NEAR(evaluation.mesh->in_mesh(), 0.5 + 0.25 / 10, 0.02);
  EXPECT_NEAR(evaluation.mesh->not_object(), 1 / (area_mm2(half) + 1), 0.002);
  const std::string table = to_table(evaluation);
  EXPECT_LT(table.find("touched surface"), table.find("accuracy"));
  EXPECT_THAT(table,
              testing::ContainsRegex("touched surface +1\\.[0-9]+ cm², 0\\.5[0-9]+ of it in the mesh"));
  const json mesh = json::parse(to_json(evaluation))["mesh"];
  EXPECT_NEAR(mesh["area_cm2"], 0.01 * area_mm2(truth), 0.01);
  EXPECT_EQ(mesh["in_mesh"], evaluation.mesh->in_mesh());
  EXPECT_EQ(mesh["not_touched"], evaluation.mesh->not_object());
}

/// As near as its own, but not its relief.
TEST(Evaluate, TheTruthOfAnotherObjectIsDoubted) {
  Scene scene;
  scene.write_truth();
  scene.write_run(5);
  scene.write_meshes(5);
  EXPECT_EQ(scene.evaluated().warning(), "");
  const auto other = [](double x, double y) { return 0.4 * bumps(y + 0.7, -x); };
  write_mesh(scene.data / "gt_mesh.ply", height_field(-5, 5, -5, 5, 60, other));
  const Evaluation evaluation = scene.evaluated();
  EXPECT_THAT(evaluation.warning(), HasSubstr("is it the truth of this object"));
}

TEST(Evaluate, AWrongAnchorIsAnErrorInTheMesh) {
  Scene scene;
  scene.write_truth();
  scene.write_run(0);
  scene.write_meshes(10);  // the mesh is in another frame than the trajectory says
  EXPECT_GT(scene.evaluated().mesh->at_known_pose.accuracy.mean_mm, 0.1);
}

TEST(Evaluate, ABareTrajectoryIsJudgedFromItsFirstFrame) {
  Scene scene;
  scene.write_truth();
  scene.write_run(5, 3);
  const Comparison comparison = compare(scene.run / "trajectory.tum", scene.data.path());
  const Evaluation evaluation = evaluate(comparison, place_meshes(comparison));
  EXPECT_EQ(evaluation.reference_frame, 3 + kBackground);
  EXPECT_LT(evaluation.trajectory->ate_mm, 1e-6);
  EXPECT_FALSE(evaluation.mesh.has_value());
  EXPECT_EQ(evaluation.trials, std::nullopt);
}

/// Another system at another rate, with a gap, in another frame.
TEST(Evaluate, ATrajectoryByAnotherSystemIsMatchedByTime) {
  Scene scene;
  scene.write_run(0);
  const Pose world_T_map = motion(0.5, 1, -2, 300, 200, 100);
  std::string lines;
  for (double s = 0.3; s < 2.5; s += 0.011) {
    const double index = 25 * s - kBackground;
    const int before = static_cast<int>(std::floor(index));
    if (before >= 30 && before < 35) continue;
    lines += tum_line(
        s, world_T_map * true_pose(before) *
               se3_exp((index - before) * se3_log(true_pose(before).inverse() * true_pose(before + 1))));
  }
  write_bytes(scene.data / "truth.tum", lines);
  const Evaluation evaluation = evaluate(compare(scene.run.path(), scene.data / "truth.tum"), std::nullopt);
  EXPECT_LT(evaluation.trajectory->ate_mm, 1e-3);
  EXPECT_LT(evaluation.trajectory->over_one_second.translation_mm, 1e-3);
  EXPECT_EQ(evaluation.trajectory->over_one_second.pairs, 9);
  EXPECT_LT(evaluation.trajectory->mae_deg.norm(), 1e-3);
  EXPECT_THAT(to_table(evaluation),
              HasSubstr("relative to the pose at 0.400000 s (of the true one as the sensor's own)"));
  EXPECT_THAT(to_table(evaluation), HasSubstr("compared                34 of 40 poses"));
  EXPECT_EQ(json::parse(to_json(evaluation))["reference_frame"], nullptr);
  write_bytes(scene.data / "truth.tum", tum_line(1e9, Pose::Identity()));
  EXPECT_THAT(message_of([&] { compare(scene.run.path(), scene.data / "truth.tum"); }),
              HasSubstr("are both in Unix time, or from one start?"));
}

/// The same truth in millimeters, with its quaternions in another order, and with one pose only.
TEST(Evaluate, ATrajectoryInAnotherNotationIsAskedAbout) {
  Scene scene;
  scene.write_run(0);
  const auto warning = [&](const std::function<std::string(int)>& line) {
    std::string lines;
    for (int i = 0; i < kFrames; ++i) lines += line(i);
    write_bytes(scene.data / "truth.tum", lines);
    return evaluate(compare(scene.run.path(), scene.data / "truth.tum"), std::nullopt).warning();
  };
  const auto time_s = [](int i) { return (i + kBackground) / 25.0; };
  EXPECT_EQ(warning([&](int i) { return tum_line(time_s(i), true_pose(i)); }), "");
  EXPECT_THAT(warning([&](int i) {
                Pose in_mm = true_pose(i);
                in_mm.translation() *= 1000;
                return tum_line(time_s(i), in_mm);
              }),
              HasSubstr("1000 times as long as the run's: are the true positions in millimeters?"));
  EXPECT_THAT(warning([&](int i) {
                const Eigen::Quaterniond q(true_pose(i).linear());
                const Eigen::Vector3d at_m = 1e-3 * true_pose(i).translation();
                std::ostringstream line;
                line << std::setprecision(12) << time_s(i) << " " << at_m.transpose() << " " << q.w() << " "
                     << q.vec().transpose() << "\n";
                return line.str();
              }),
              HasSubstr("are they qw qx qy qz?"));
  EXPECT_THAT(
      message_of([&] { warning([&](int i) { return i == 20 ? tum_line(time_s(i), true_pose(i)) : ""; }); }),
      HasSubstr("there is nothing to measure"));
}

TEST(Evaluate, TruthOfAnotherLengthIsNoticed) {
  Scene scene;
  scene.write_truth(kFrames - 5);  // beside a meta.json that says otherwise
  scene.write_run(0);
  EXPECT_THAT(scene.error(), HasSubstr("another log"));
  scene.meta["frames"] = kFrames - 5 + kBackground;
  scene.write_truth(kFrames - 5);  // report.json says otherwise
  EXPECT_THAT(scene.error(), HasSubstr("50 frames"));
  RunReport part = Scene::report_of(kBackground, 10);
  part.partial = true;
  scene.write_report(part);  // only the trajectory reaches beyond
  EXPECT_THAT(scene.error(), HasSubstr("another log"));
  scene.write_run(0, 0, kFrames - 6);
  scene.write_report(part);
  EXPECT_EQ(scene.error(), "nothing was thrown");
}

TEST(Evaluate, TimesThatAreNoFramesAreNoticed) {
  Scene scene;
  scene.write_truth();
  scene.write_run(0, 0, kFrames - 1, 30.0);
  EXPECT_THAT(scene.error(), HasSubstr("no frame"));
  write_bytes(scene.run / "trajectory.tum", "0.4 0 0 0 0 0 0 1\n0.401 0 0 0 0 0 0 1\n");
  EXPECT_THAT(scene.error(), HasSubstr("two poses"));
  write_bytes(scene.run / "trajectory.tum", "1e300 0 0 0 0 0 0 1\n");
  EXPECT_THAT(scene.error(), HasSubstr("no frame"));
  write_bytes(scene.run / "trajectory.tum", "0.04 0 0 0 0 0 0 1\n");  // background only
  EXPECT_THAT(scene.error(), HasSubstr("both an estimated and a true pose"));
  write_bytes(scene.run / "trajectory.tum", "");
  EXPECT_THAT(scene.error(), HasSubstr("empty"));
}

TEST(Evaluate, DamagedTruthIsNoticed) {
  Scene scene;
  scene.write_run(0);
  EXPECT_THAT(scene.error(), HasSubstr("no ground truth"));
  scene.write_truth(kFrames, kFrames);
  EXPECT_THAT(scene.error(), HasSubstr("only NaN"));
  const auto poses = scene.data / "true_start_T_currs.npy";
  std::vector<double> numbers = numbers_in_meters(kFrames, 0);
  write_npy(poses, {kFrames, 16}, std::span<const double>(numbers));
  EXPECT_THAT(scene.error(), HasSubstr("N x 4 x 4"));
  numbers[16 * 7] += 0.1;
  write_npy(poses, {kFrames, 4, 4}, std::span<const double>(numbers));
  EXPECT_THAT(scene.error(), HasSubstr("pose 7 is not a rigid motion"));
  numbers[16 * 7] = std::numeric_limits<double>::infinity();
  write_npy(poses, {kFrames, 4, 4}, std::span<const double>(numbers));
  EXPECT_THAT(scene.error(), HasSubstr("not a rigid motion"));
  write_bytes(poses, "\x93NUMPY");
  EXPECT_NE(scene.error(), "nothing was thrown");
  EXPECT_THAT(message_of([&] { read_ground_truth(scene.data / "none"); }), HasSubstr("no folder"));
}

TEST(Evaluate, InterruptedRunsAndEmptyMeshesAreJudgedAsFarAsTheyGo) {
  Scene scene;
  scene.write_truth();
  scene.write_run(0, 0, 20);
  scene.write_meshes(0);
  RunReport report = Scene::report_of(kBackground, 31);
  report.partial = true;
  scene.write_report(report);
  EXPECT_EQ(scene.evaluated().trajectory->compared_frames, 21);
  report.partial = false;
  report.frames.left_out = 2;
  scene.write_report(report);
  EXPECT_EQ(scene.evaluated().trajectory->compared_frames, 21);
  report.frames.left_out = 0;
  scene.write_report(report);
  EXPECT_THAT(scene.error(), HasSubstr("31 frames"));
  write_bytes(scene.run / "mesh.ply", "ply\n");  // what an empty mesh's file holds does not matter
  report.partial = true;
  report.mesh.triangles = 0;
  scene.write_report(report);
  EXPECT_FALSE(scene.evaluated().mesh.has_value());
}

}  // namespace
}  // namespace gelslam::test
