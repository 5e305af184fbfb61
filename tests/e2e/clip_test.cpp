// The program on real pictures of a hand that rolls a peanut: dithered, 15 Hz, several degrees per frame.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

TEST(RealClip, ThePeanutIsOneMapWithNearlyEveryFrameInIt) {
  const fs::path data = test::data_folder();
  if (!fs::exists(data / "clips/peanut")) GTEST_SKIP() << "no clips in " << data << "; set GELSLAM_DATA";
  const test::TemporaryFolder folder;
  const test::ProgramResult result =
      test::run_program(GELSLAM_PROGRAM, {"reconstruct", (data / "clips/peanut").string(), "-o",
                                          (folder / "run").string(), "--config", GELSLAM_CLIP_CONFIG,
                                          "--background", (data / "clips/background.png").string(), "--model",
                                          (data / "calibration/model/nnmodel.pth").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(test::read_bytes(folder / "run/report.json"));
  EXPECT_LE(report.at("frames").at("not_in_mesh"), 1)
      << "contact nearly fades at frame 61, and is recognized again";
  EXPECT_GE(report.at("frames").at("in_map"), 100) << "of 109, one without contact; five or six jumps of the "
                                                      "sped up clip fit nowhere, or at several places";
}

}  // namespace
}  // namespace gelslam
