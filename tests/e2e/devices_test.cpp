#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/run_program.hpp"

namespace gelslam::test {
namespace {

// What cameras there are depends on the machine; what the command owes does not.

TEST(Devices, JsonIsOneObjectAndTheExitCodeSaysWhetherThereIsACamera) {
  const ProgramResult result = run_program(GELSLAM_PROGRAM, {"devices", "--json"});
  const auto cameras = nlohmann::json::parse(result.out).at("cameras");
  bool any = false;
  for (const auto& camera : cameras) any = any || camera.at("kind") == "camera";
  EXPECT_EQ(result.exit_code, any ? 0 : 1);
  EXPECT_EQ(result.err, "");
}

TEST(Devices, ForPeopleThereIsAlwaysASentence) {
  const ProgramResult result = run_program(GELSLAM_PROGRAM, {"devices"});
  EXPECT_THAT(result.out,
              testing::AnyOf(testing::HasSubstr("no camera is connected"), testing::HasSubstr("/dev/video")));
  EXPECT_EQ(result.err, "");
}

TEST(Devices, ACameraThatIsNotThereIsOneLine) {
  for (const char* device : {"/dev/null", "/dev/video987", "no such camera"}) {
    const TemporaryFolder folder;
    const ProgramResult result =
        run_program(GELSLAM_PROGRAM, {"record", "--camera", device, "-o", (folder / "x.mkv").string()});
    EXPECT_EQ(result.exit_code, 2) << device;
    EXPECT_EQ(result.error_lines(), 1) << result.err;
    EXPECT_TRUE(folder.names().empty()) << "nothing is begun";
  }
}

}  // namespace
}  // namespace gelslam::test
