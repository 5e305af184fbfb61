#include <gtest/gtest.h>

#include "../sensor/raw_frames.hpp"
#include "../support/temporary_folder.hpp"
#include "../surface/linear_gel.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/surface_stream.hpp"

namespace gelslam::test {
namespace {

constexpr double kHalfPixelMm2 = 0.5 * 0.0634 * 0.0634;  // a configuration states areas in pixels

/// A log folder with all files that it needs. Its PNG pictures show a gel of known colors, and the first ten
/// show it bare.
class RecordedLog : public testing::Test {
 protected:
  RecordedLog() {
    write_pth_model(folder / "model.pth", linear_gel_model());
    input.log = folder / "a.mkv";
  }

  void record(const LogAttachments& attachments, int frames = 1) {
    LogWriter writer(input.log, attachments, 25);
    for (int i = 0; i < frames; ++i) {
      const cv::Size size(320, 240);
      const cv::Mat1f height = i < 10 ? cv::Mat1f(size, 0.0F) : ball_press(size, 0.0634, 150, 120, 5, 0.8);
      RawFrame frame = bgr_frame(render(height, 0.0634, 1.0, static_cast<std::uint64_t>(i)), i);
      frame.time_s = 0.041 * i;
      ASSERT_TRUE(writer.write(frame));
    }
  }

  Config with_model() {
    Config config;
    config.sensor.calibration_model_path = folder / "model.pth";
    config.slam.tracker.min_contact_mm2 = 1.6;
    return config;
  }

  TemporaryFolder folder;
  LogInput input;
};

TEST_F(RecordedLog, StandsOnItsOwn) {
  record(attachments_of(with_model()), 12);
  fs::remove(folder / "model.pth");
  const Config config = resolve_config(input);
  EXPECT_NEAR(config.slam.tracker.min_contact_mm2, 1.6, kHalfPixelMm2) << "the recorded configuration";
  EXPECT_EQ(config.sensor.calibration_model_path, fs::absolute(input.log));
  EXPECT_EQ(read_gradient_model(input.log), linear_gel_model());
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  for (int i = 0; i < 12; ++i) {
    const auto item = stream.next();
    ASSERT_TRUE(item);
    EXPECT_NEAR(item->image.time_s, 0.041 * i, 1e-6);
    ASSERT_EQ(item->surface != nullptr, i >= 10);
    if (i >= 10) {
      EXPECT_GT(item->surface->contact_pixels, 500);
    }
  }
  EXPECT_FALSE(stream.next());
  EXPECT_EQ(stream.warning(), "");
}

TEST_F(RecordedLog, WhatAPersonNamesGoesFirst) {
  record(attachments_of(with_model()));
  write_bytes(folder / "config.yaml", "gelslam_config:\n  track_config:\n    contact_threshold: 600\n");
  EXPECT_NEAR(resolve_config(input).slam.tracker.min_contact_mm2, 1.6, kHalfPixelMm2)
      << "not the one beside the log";
  input.config = folder / "config.yaml";
  EXPECT_NEAR(resolve_config(input).slam.tracker.min_contact_mm2, 600 * 2 * kHalfPixelMm2, 1e-9);
  EXPECT_EQ(resolve_config(input).sensor.calibration_model_path, fs::absolute(input.log));
  write_bytes(folder / "config.yaml", "device_config:\n  calibration_model_path: model.pth\n");
  EXPECT_EQ(resolve_config(input).sensor.calibration_model_path.filename(), "model.pth");
  input.config.clear();
  write_pth_model(folder / "other.pth", linear_gel_model());
  input.model = folder / "other.pth";
  EXPECT_EQ(resolve_config(input).sensor.calibration_model_path.filename(), "other.pth");
}

TEST_F(RecordedLog, OpticsAreOfTheModelElseTheLogElseTheMini) {
  input.model = folder / "model.pth";
  const auto found = [&] {
    const Config config = resolve_config(input);
    return std::pair(config.optics_from, config.surface.optics);
  };
  record({});
  EXPECT_EQ(found(), std::pair(std::string("GelSight Mini"), kGelSightMiniOptics));
  write_bytes(folder / "config.yaml", "device_config:\n  ppmm: 0.0317\n");  // the middle half of the picture
  EXPECT_NEAR(found().second.lens_k1, kGelSightMiniOptics.lens_k1 / 4, 1e-9);
  EXPECT_EQ(found().second.gel_dome_per_mm, kGelSightMiniOptics.gel_dome_per_mm);
  write_bytes(folder / "config.yaml", "device_config:\n  device_name: DIGIT\n");
  EXPECT_EQ(found(), std::pair(std::string("default"), SensorOptics{}));
  fs::create_directory(folder / "elsewhere");
  input.log = fs::path(folder / "elsewhere/a.mkv");
  fs::copy(folder / "a.mkv", input.log);
  const SensorOptics of_log{0, {0, 0}, 1, 30, {0, 0}}, of_model{0, {0, 0}, 1, 25, {0, 0}};
  write_optics(folder / "elsewhere/optics.yaml", of_log);
  EXPECT_EQ(found(), std::pair(std::string("log"), of_log));
  write_bytes(folder / "elsewhere/config.yaml", "device_config:\n  optics: {camera_distance_mm: 40}\n");
  EXPECT_EQ(found().first, "configuration");
  EXPECT_EQ(found().second.camera_distance_mm, 40);
  write_optics(folder / "optics.yaml", of_model);
  EXPECT_EQ(found(), std::pair(std::string("model"), of_model));
}

}  // namespace
}  // namespace gelslam::test
