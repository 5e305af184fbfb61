#include "gelslam/slam/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::Not;

class ConfigFile : public testing::Test {
 protected:
  Config read(const std::string& yaml) {
    write_bytes(folder / "config.yaml", yaml);
    return read_config(folder / "config.yaml");
  }

  TemporaryFolder folder;
};

TEST_F(ConfigFile, EveryValueSurvivesWritingAndReading) {
  Config config;
  config.sensor.device_name = "a \"sensor\": with # signs";
  config.sensor.pixel_pitch_mm = 0.1 / 3;
  config.sensor.width_px = 160;
  config.sensor.height_px = 120;
  config.sensor.raw_width_px = 640;
  config.sensor.raw_height_px = 480;
  config.sensor.frame_rate_hz = 59.94;
  config.sensor.cropped = true;
  config.sensor.video_track = 2;
  config.sensor.camera = "DIGIT D20966";
  config.sensor.camera_format = "YUYV";
  config.sensor.camera_controls = "exposure_time_absolute=120, gain=3";
  config.sensor.calibration_model_path = folder / "some model.pth";
  config.surface.color_dist_threshold = 12.5;
  config.surface.height_threshold_mm = 0.123456789012345;
  config.surface.compensate_light = !config.surface.compensate_light;
  config.surface.optics = {0.05, {1, 2}, 1.1, 23, {0.003, 0.004}};
  config.background_frames = 7;
  config.color_gain_bgr = {1.25, 0.75, 1.5};
  SlamOptions& slam = config.slam;
  slam.tracker.contact_threshold_px = 321;
  slam.tracker.keyframe_min_shared = 0.61;
  slam.tracker.keyframe_min_unseen = 0.07;
  slam.tracker.patience_s = 0.3;
  slam.tracker.relocalize = !slam.tracker.relocalize;
  slam.registration.max_samples = 2222;
  slam.registration.max_iterations = 33;
  slam.registration.min_iterations = 4;
  slam.registration.robust_scale_rad = 0.07;
  slam.registration.curvature.min_scr = 0.31;
  slam.registration.curvature.min_ccs = 0.72;
  slam.loop_closure.min_sift_inliers = 9;
  slam.verification.curvature.min_scr = 0.41;
  slam.verification.curvature.min_ccs = 0.82;
  slam.pose_graph.loop_loss_scale = 2.5;
  slam.gradient_scale.sigma = 0.2;
  slam.gradient_scale.estimate = !slam.gradient_scale.estimate;
  slam.refinement.max_pairs_per_keyframe = 5;
  slam.fusion.voxel_size_mm = 0.11;
  slam.fusion.truncation_mm = 0.9;
  const std::string text = write_config(config);
  const Config back = read(text);
  EXPECT_EQ(write_config(back), text);
  EXPECT_EQ(back.sensor.device_name, config.sensor.device_name);
  EXPECT_EQ(back.sensor.pixel_pitch_mm, config.sensor.pixel_pitch_mm) << "to the last bit";
  EXPECT_EQ(back.slam.verification.curvature.min_ccs, 0.82);
  std::istringstream changed(text), defaults(write_config({}));
  for (std::string line, other; std::getline(changed, line) && std::getline(defaults, other);) {
    EXPECT_EQ(line.substr(0, line.find(':')), other.substr(0, other.find(':')));
    const bool has_value = line.find(':') != line.npos && line.find(":  #") == line.npos;
    EXPECT_TRUE(line != other || !has_value) << "not tested: " << line;
  }
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
  EXPECT_EQ(std::filesystem::weakly_canonical(config.sensor.calibration_model_path),
            std::filesystem::weakly_canonical(folder / "../calibration/model/nnmodel.pth"))
      << "relative to the file";
  EXPECT_EQ(config.surface.color_dist_threshold, 14);
  EXPECT_EQ(config.surface.height_threshold_mm, 0.3);
  EXPECT_EQ(config.slam.tracker.contact_threshold_px, 600);
  EXPECT_EQ(config.slam.registration.curvature.min_scr, 0.35);
  EXPECT_EQ(config.slam.registration.curvature.min_ccs, 0.75);
  EXPECT_THAT(write_config(config), Not(HasSubstr("coverage_graph"))) << "it means nothing here";
  EXPECT_EQ(config.slam.loop_closure.min_sift_inliers, 10);
  EXPECT_EQ(config.slam.verification.curvature.min_scr, 0.4);
  EXPECT_EQ(config.slam.verification.curvature.min_ccs, 0.8);
}

}  // namespace
}  // namespace gelslam
