#include "gelslam/core/sensor_optics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

using test::message_of;
using ::testing::HasSubstr;

std::string problem_with(const SensorOptics& optics) { return why_impossible(optics, 320, 240, 0.0634); }

TEST(SensorOptics, FileGivesTheSameNumbersBack) {
  const test::TemporaryFolder folder;
  const SensorOptics optics{0.1 / 3, {1.25, -2}, 1.01, 21.5, {0.0017, -1e-4}};
  write_optics(folder / "optics.yaml", optics);
  EXPECT_EQ(read_optics(folder / "optics.yaml"), optics);
  EXPECT_EQ(find_optics(folder / "nnmodel.pth"), optics);
  EXPECT_FALSE(find_optics(folder / "elsewhere" / "nnmodel.pth"));
}

TEST(SensorOptics, FileWithImpossibleValuesIsRefusedInOneLine) {
  const test::TemporaryFolder folder;
  const auto error_with = [&](const std::string& text) {
    write_file_atomically(folder / "optics.yaml", text);
    return message_of([&] { read_optics(folder / "optics.yaml"); });
  };
  EXPECT_THAT(error_with("lens_k1: 0.4\n"), HasSubstr("optics.yaml:1: lens_k1 is 0.4"));
  EXPECT_THAT(error_with("lens_center_px: 3\n"), HasSubstr("two numbers"));
  EXPECT_THAT(error_with("lens_center_px: [3]\n"), HasSubstr("two numbers"));
  EXPECT_THAT(error_with("gel_dome_per_mm: [0.1, .nan]\n"), HasSubstr("gel_dome_per_mm must be a number"));
  EXPECT_THAT(error_with("lens_k2: 0.1\n"), HasSubstr("lens_k1?"));
}

TEST(SensorOptics, SaysWhichNumberNoSensorHas) {
  EXPECT_EQ(problem_with({}), "");
  EXPECT_EQ(problem_with({.lens_k1 = 0.037, .camera_distance_mm = 22, .gel_dome_per_mm = {0.0017, 0.0028}}),
            "");
  EXPECT_THAT(problem_with({.lens_k1 = std::numeric_limits<double>::quiet_NaN()}), HasSubstr("lens_k1"));
  EXPECT_THAT(problem_with({.lens_center_px = {0, 121}}), HasSubstr("lens_center_px"));
  EXPECT_THAT(problem_with({.pixel_aspect = 0}), HasSubstr("pixel_aspect"));
  EXPECT_THAT(problem_with({.camera_distance_mm = 4.9}), HasSubstr("camera_distance_mm"));
  EXPECT_THAT(problem_with({.gel_dome_per_mm = {0.03, 0}}), HasSubstr("gel_dome_per_mm"));
}

}  // namespace
}  // namespace gelslam
