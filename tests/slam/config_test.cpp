#include "gelslam/slam/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "../support/temporary_folder.hpp"

namespace gelslam::test {
namespace {

class ConfigFile : public testing::Test {
 protected:
  Config read(const std::string& yaml) {
    write_bytes(folder / "config.yaml", yaml);
    return read_config(folder / "config.yaml");
  }

  TemporaryFolder folder;
};

/// The default configuration, with another value on each line.
std::string with_other_values() {
  const std::regex with_value("( *\\w+: )(\\S.*?)(  # .*)");
  std::istringstream defaults(write_config({}));
  std::string text;
  std::smatch line_parts;
  int count = 10;
  for (std::string line; std::getline(defaults, line); text += "\n") {
    if (!std::regex_match(line, line_parts, with_value)) {  // a section
      text += line;
      continue;
    }
    std::string value = line_parts[2];
    const std::string comment = line_parts[3], digits = std::to_string(++count) + "1";
    const bool is_real = (value + comment).find('.') != line.npos;
    if (value == "true" || value == "false")
      value = value == "true" ? "false" : "true";
    else if (value.front() == '"')
      value = "\"/a \\\"" + digits + "\\\": with # signs\"";
    else if (value.front() == '[')
      value = "[0.00" + digits + ", 0.0" + digits + "]";
    else if (is_real)
      value += (value.find('.') == value.npos ? "." : "") + digits;
    else
      value = std::to_string(std::stoi(value) + count);
    text += line_parts[1].str() + value + comment;
  }
  return text;
}

TEST_F(ConfigFile, EveryValueSurvivesReadingAndWriting) {
  const std::string text = with_other_values();
  EXPECT_EQ(write_config(read(text)), text);
  Config config;
  config.sensor.pixel_pitch_mm = 0.1 / 3;
  EXPECT_EQ(read(write_config(config)).sensor.pixel_pitch_mm, 0.1 / 3) << "to the last bit";
}

TEST_F(ConfigFile, PixelsPerMillimeterAreNotTakenForThePitch) {
  EXPECT_THAT(
      message_of([&] { read("device_config:\n  ppmm: 18.6\n"); }),
      HasSubstr("ppmm is 18.6, must be from 0.001 to 1: mm per pixel after crop and resize, not pixels "
                "per mm: perhaps 0.05376"));
}

TEST_F(ConfigFile, ThePublicConfigurationIsReadAsItIs) {
  const Config config = read(R"(device_config:
  device_name: "GelSight Mini"
  ppmm: 0.05
  imgh: 120
  imgw: 160
  raw_imgh: 2464
  raw_imgw: 3280
  framerate: 30
  calibration_model_path: "../calibration/model/nnmodel.pth"
contact_mask_config:
  color_dist_threshold: 14
  height_threshold: 0.3
gelslam_config:
  track_config:
    contact_threshold: 600
    scr_threshold: 0.35
    ccs_threshold: 0.75
  pose_graph_config:
    coverage_graph_overlap_threshold: 55
    min_sift_inliers: 10
    scr_threshold: 0.4
    ccs_threshold: 0.8
)");
  EXPECT_EQ(config.sensor.pixel_pitch_mm, 0.05);
  EXPECT_EQ(config.surface.pixel_pitch_mm, 0.05) << "the surface stage must know, too";
  EXPECT_EQ(config.sensor.height_px, 120);
  EXPECT_EQ(config.sensor.width_px, 160);
  EXPECT_EQ(config.sensor.raw_width_px, 3280);
  EXPECT_EQ(config.sensor.frame_rate_hz, 30);
  EXPECT_TRUE(config.sensor.calibration_model_path.is_absolute());
  EXPECT_EQ(fs::weakly_canonical(config.sensor.calibration_model_path),
            fs::weakly_canonical(folder / "../calibration/model/nnmodel.pth"))
      << "relative to the file";
  EXPECT_DOUBLE_EQ(config.slam.tracker.min_contact_mm2, 1.5) << "600 pixels of 0.05 mm";
  EXPECT_EQ(config.slam.registration.curvature.min_scr, 0.35);
  EXPECT_EQ(config.slam.registration.curvature.min_ccs, 0.75);
  EXPECT_THAT(write_config(config),
              Not(AnyOf(HasSubstr("coverage_graph"), HasSubstr("color_dist"), HasSubstr("height_threshold"))))
      << "they mean nothing here";
  EXPECT_EQ(config.slam.loop_closure.min_sift_inliers, 10);
  EXPECT_EQ(config.slam.verification.curvature.min_scr, 0.4);
  EXPECT_EQ(config.slam.verification.curvature.min_ccs, 0.8);
}

}  // namespace
}  // namespace gelslam::test
