#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/trajectory.hpp"

namespace gelslam::test {
namespace {

std::vector<StampedPose> read(const std::string& text) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.tum", text);
  return read_tum(folder / "a.tum");
}

TEST(ReadTum, ReadsMetersAndQuaternionsAsXyzw) {
  const auto trajectory = read(
      "# time x y z qx qy qz qw\n\n"
      "0.4 0.001 -0.002 3e-3 0 0 0 1\r\n"
      "  0.44\t0 0 0 0 0 0.70710678 0.70710678  \n");
  ASSERT_EQ(trajectory.size(), 2U);
  EXPECT_DOUBLE_EQ(trajectory[0].time_s, 0.4);
  EXPECT_NEAR((trajectory[0].map_T_sensor.translation() - Eigen::Vector3d(1, -2, 3)).norm(), 0.0, 1e-12);
  const Eigen::Vector3d turned = trajectory[1].map_T_sensor * Eigen::Vector3d(1, 0, 0);
  EXPECT_NEAR((turned - Eigen::Vector3d(0, 1, 0)).norm(), 0.0, 1e-7);  // a quarter turn about z
}

TEST(ReadTum, RefusesWhatIsNoTrajectory) {
  const std::string good = "0.4 0 0 0 0 0 0 1\n";
  const std::pair<std::string, std::string> cases[] = {
      {"0.4 0 0 0 0 0 0\n", "line 1"},
      {good + "0.44 0 0 0 0 0 0 1 9\n", "line 2"},
      {good + "0.44 0 0 nan 0 0 0 1\n", "finite"},
      {good + "0.44 0 0 1e999 0 0 0 1\n", "finite"},
      {good + "0.44 0 0 x 0 0 0 1\n", "eight"},
      {good + "0.44,0,0,0,0,0,0,1\n", "eight"},
      {good + "0.44 0 0 0 0 0 0 0\n", "unit length"},
      {good + "0.44 0 0 0 1 1 1 1\n", "unit length"},
      {good + "0.44 0 1e9 0 0 0 0 1\n", "1 km"},
      {good + good, "does not increase"},
      {good + "0.1 0 0 0 0 0 0 1\n", "does not increase"},
      {std::string(10'000, '7'), "too long"},
      {std::string(100, '\0'), "eight"},
  };
  for (const auto& [text, why] : cases) {
    EXPECT_THAT(message_of([&, &content = text] { read(content); }), HasSubstr(why)) << text.substr(0, 80);
  }
}

}  // namespace
}  // namespace gelslam::test
