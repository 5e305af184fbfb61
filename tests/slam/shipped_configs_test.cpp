// Tests the files in configs/: each can be read, and selects the camera mode that it states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "../sensor/fake_camera.hpp"
#include "../support/temporary_folder.hpp"
#include "cameras/v4l2_camera.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam::test {
namespace {

const fs::path kConfigs = GELSLAM_CONFIGS;

TEST(ShippedConfigs, AllCanBeReadAndWrittenAgain) {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kConfigs)) {
    names.push_back(entry.path().filename().string());
    const std::string text = write_config(read_config(entry.path()));  // an unknown key would throw
    write_bytes(folder / "again.yaml", text);
    EXPECT_EQ(write_config(read_config(folder / "again.yaml")), text) << names.back();
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"gelsight_mini.yaml", "digit.yaml", "clip.yaml"}));
}

/// The DIGIT is not the first camera of the computer.
TEST(ShippedConfigs, DigitYamlAsksADigitForWhatItGives) {
  const Config config = read_config(kConfigs / "digit.yaml");
  FakeCamera other, sensor;
  other.card = "HD Webcam";
  sensor.path = "/dev/video3";
  sensor.bus = "usb-2";
  sensor.card = "DIGIT: DIGIT";
  // As digit-interface lists its streams: QVGA and VGA, uncompressed.
  sensor.modes = {{V4L2_PIX_FMT_YUYV, 320, 240, {60, 30}}, {V4L2_PIX_FMT_YUYV, 640, 480, {30, 15}}};
  const std::vector<std::uint8_t> green(2u * 640 * 480, 90);
  sensor.frames.push_back({.bytes = green});
  const detail::VideoSystem system = fake_system({&other, &sensor});
  const auto camera = open_camera(camera_options(config.sensor), system);
  EXPECT_EQ(camera->description(), "DIGIT: DIGIT, /dev/video3, YUYV 640x480, 30 Hz");
  EXPECT_EQ(camera->warning(), "");
  const auto frame = camera->next();
  ASSERT_TRUE(frame.has_value());
  FrameDecoder decoder(config.sensor);
  const auto image = decoder.decode(*frame);
  ASSERT_TRUE(image.has_value()) << decoder.damage();
  EXPECT_EQ(image->bgr.size(), cv::Size(config.sensor.width_px, config.sensor.height_px));
}

}  // namespace
}  // namespace gelslam::test
