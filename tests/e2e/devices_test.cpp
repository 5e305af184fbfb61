#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/run_program.hpp"

namespace gelslam::test {
namespace {

TEST(Devices, JsonIsOneObjectAndTheExitCodeSaysWhetherThereIsACamera) {
  const ProgramResult result = gelslam({"devices", "--json"});
  const auto cameras = nlohmann::json::parse(result.out).at("cameras");
  bool any = false;
  for (const auto& camera : cameras) any = any || camera.at("kind") == "camera";
  EXPECT_EQ(result.exit_code, any ? 0 : 1);
  EXPECT_EQ(result.err, "");
}

}  // namespace
}  // namespace gelslam::test
