#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/data_folder.hpp"
#include "../support/pictures.hpp"
#include "../support/run_program.hpp"
#include "gelslam/core/run_report.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using ::testing::HasSubstr;

ProgramResult info(const fs::path& path, bool json = false) {
  std::vector<std::string> arguments{"info", path.string()};
  if (json) arguments.push_back("--json");
  return gelslam(arguments);
}

TEST(Info, AFolderWithProblemsStillSaysWhatIsGood) {
  const TemporaryFolder folder;
  write_video(folder / "gelsight.avi", "MJPG", 3, 320, 240, 25.0, /*gray=*/true);
  write_bytes(folder / "config.yaml", "device_config:\n  framerat: 25\n");
  write_bytes(folder / "true_start_T_currs.npy", "x");
  const ProgramResult result = info(folder.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "");
  EXPECT_THAT(result.out, HasSubstr("320x240, 25 Hz, 3 frames"));
  EXPECT_THAT(result.out,
              HasSubstr("config.yaml:2: device_config.framerat is an unknown key, did you mean framerate?"));
  EXPECT_THAT(result.out, HasSubstr("frame 0: a gray picture"));
  EXPECT_THAT(result.out, HasSubstr("true_start_T_currs.npy: not a usable .npy file"));
}

TEST(Info, ARunFolder) {
  const TemporaryFolder folder;
  RunReport report;
  report.trials = 3;
  report.components = 1;
  write_bytes(folder / "report.json", report_json(report));
  EXPECT_THAT(info(folder.path()).out, HasSubstr("is no run folder"));
  write_bytes(folder / "trajectory.tum", "0.4 0 0 0 0 0 0 1\n");
  const ProgramResult result = info(folder.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("3 trials in 1 component"));
  EXPECT_THAT(result.out, HasSubstr("holds no mesh.ply"));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("use "))) << "nothing takes it";
  write_bytes(folder / "report.json", R"({"frames": 245, )");
  EXPECT_THAT(info(folder.path()).out, HasSubstr("report.json: is damaged"));
}

TEST(Info, ARunSaysWhatItLacks) {
  const TemporaryFolder folder;
  RunReport report;
  report.warnings = {"the gel may be dirty", "is it this sensor's model?"};
  report.result_warnings = {"2 components not joined", "poses may be off by 2 mm"};
  write_bytes(folder / "report.json", report_json(report));
  write_bytes(folder / "trajectory.tum", "0.4 0 0 0 0 0 0 1\n0.8 0.003 0.004 0 0 0 0 1\n");
  const std::string missing = "2 components not joined";
  for (const fs::path& path : {folder.path(), folder / "report.json"}) {
    const ProgramResult run = info(path);
    EXPECT_THAT(run.out, HasSubstr("warning    " + missing + "\n"));
    EXPECT_THAT(run.out, HasSubstr("warning    poses may be off by 2 mm\n"));
    EXPECT_THAT(run.out,
                HasSubstr("warning    the gel may be dirty\n  warning    is it this sensor's model?\n"));
    EXPECT_THAT(run.out, HasSubstr("5 mm in 0.4 s"));
  }
  EXPECT_EQ(nlohmann::json::parse(info(folder.path(), true).out).at("warnings").at(2), missing);
  EXPECT_THAT(on_terminal(GELSLAM_PROGRAM " info " + folder.path().string()), HasSubstr("\x1b[33m" + missing))
      << "amber";
  EXPECT_THAT(info(folder / "trajectory.tum").out, HasSubstr("a trajectory\n  poses      2\n"));
}

/// Triangles of 3 mm; `corners` are nine numbers each.
std::string ascii_stl(const std::vector<std::string>& corners) {
  std::string text = "solid s\n";
  for (const std::string& corner : corners)
    text += "facet normal 0 0 1\nouter loop\n" + corner + "endloop\nendfacet\n";
  return text + "endsolid s\n";
}

constexpr const char* kTriangle = "vertex 0 0 0\nvertex 3 0 0\nvertex 0 3 0\n";
constexpr const char* kOtherTriangle = "vertex 10 0 0\nvertex 11 0 0\nvertex 10 3 0\n";

TEST(Export, SaysUnitAndLoosePieces) {
  const TemporaryFolder folder;
  write_bytes(folder / "two.stl", ascii_stl({kTriangle, kOtherTriangle}));
  const auto exported = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"export", (folder / "two.stl").string(), "--overwrite"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = gelslam(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  const std::string stl = exported({"-o", (folder / "a.stl").string()});
  EXPECT_THAT(stl, HasSubstr("two.stl: mm\n"));
  EXPECT_THAT(stl, HasSubstr("2 triangles, in mm\n"));
  EXPECT_THAT(stl, HasSubstr("2 loose pieces: the largest has 75.0 % of the area"));
  EXPECT_THAT(exported({"-o", (folder / "a.ply").string()}), HasSubstr("2 triangles, in m\n"));
  EXPECT_THAT(exported({"-o", (folder / "a.xyz").string()}), HasSubstr("6 vertices, in mm\n"));
  EXPECT_THAT(exported({"-o", (folder / "a.obj").string(), "--unit", "m"}), HasSubstr("in m\n"));
  EXPECT_EQ(exported({"-q", "-o", (folder / "b.ply").string()}), "");
  EXPECT_THAT(info(folder / "a.stl").out, HasSubstr("11 x 3 x 0 mm; its unit is mm"));
  const std::string shown = GELSLAM_PROGRAM " export " + (folder / "two.stl").string() +
                            " --max-error-mm 0.1 -o " + (folder / "s.ply").string();
  EXPECT_THAT(on_terminal(shown), HasSubstr("simplified to 2 of 2 triangles, error 0 mm"));
}

/// One triangle, as often as you like; corners in meters.
std::string ascii_ply(const std::string& corners, int faces) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face " +
      std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n" + corners;
  for (int i = 0; i < faces; ++i) text += "3 0 1 2\n";
  return text;
}

TEST(Evaluate, HostileGeometryIsOneLineAndNoLongWait) {
  const TemporaryFolder folder;
  write_bytes(folder / "truth.stl", ascii_stl({kTriangle}));
  write_bytes(folder / "far.stl", ascii_stl({kTriangle, "vertex 0 0 0\nvertex 1e30 0 0\nvertex 0 3e35 0\n"}));
  write_bytes(folder / "crowd.ply", ascii_ply("0 0 0\n0.003 0 0\n0 0.003 0\n", 30'000));
  const auto evaluate = [&](const char* mesh, const char* truth) {
    return gelslam({"evaluate", (folder / mesh).string(), "--truth", (folder / truth).string()});
  };
  EXPECT_EQ(evaluate("truth.stl", "truth.stl").exit_code, 0);
  expect_mistake(evaluate("far.stl", "truth.stl"), "is its unit right?");
  expect_mistake(evaluate("truth.stl", "far.stl"), "is its unit right?");
  write_bytes(folder / "mm.ply", ascii_ply("0 0 0\n21 0 0\n0 28 0\n", 1));
  expect_mistake(evaluate("truth.stl", "mm.ply"), "the true mesh is 35000 mm large; check its unit");
  expect_mistake(evaluate("mm.ply", "truth.stl"), "the mesh is 35000 mm large; check its unit");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"map"}, {"simulate", "scan", "--object"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {(folder / "mm.ply").string(), "-o", (folder / "out").string()});
    expect_mistake(gelslam(arguments), "is 35000 mm large; check its unit");
  }
  expect_mistake(evaluate("crowd.ply", "truth.stl"), "thousands of its triangles");
  expect_mistake(evaluate("truth.stl", "crowd.ply"), "thousands of its triangles");
}

TEST(Evaluate, ATrajectoryIsOneWhateverItsEnding) {
  const TemporaryFolder folder;
  for (const char* name : {"run.tum", "truth.txt"})
    write_bytes(folder / name, "1 0 0 0 0 0 0 1\n1.04 0.001 0 0 0 0 0 1\n");
  const ProgramResult result =
      gelslam({"evaluate", (folder / "run.tum").string(), "--truth", (folder / "truth.txt").string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, testing::MatchesRegex("Trajectory, .*\n  ATE \\(RMSE\\) +0\\.0000 mm.*"));
}

TEST(Info, DamagedSingleFilesAreMistakes) {
  const TemporaryFolder folder;
  for (const char* name : {"a.pth", "a.yaml", "a.npy", "a.ply", "a.obj", "a.stl", "a.mkv"}) {
    write_bytes(folder / name, std::string("\0[[[{:", 6) + std::string(200, '\xff'));
    const ProgramResult result = info(folder / name);
    expect_mistake(result, name);
  }
}

}  // namespace
}  // namespace gelslam
