#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>

#include "../support/temporary_folder.hpp"
#include "cameras/v4l2_camera.hpp"
#include "fake_camera.hpp"

namespace gelslam::test {
namespace {

/// A UVC camera whose exposure and white balance follow the picture until they are told not to, and whose
/// exposure then falls back to what was set by hand before.
class CameraControls : public testing::Test {
 protected:
  CameraControls() {
    camera.controls = {
        {V4L2_CID_BRIGHTNESS, {"Brightness", 8}},
        {V4L2_CID_AUTO_WHITE_BALANCE, {"White Balance, Automatic", 1, 0, 1, V4L2_CTRL_TYPE_BOOLEAN}},
        {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {"White Balance Temperature", 5120, 2800, 6500}},
        {V4L2_CID_GAIN, {"Gain", 3}},
        {V4L2_CID_EXPOSURE_AUTO,
         {"Auto Exposure", V4L2_EXPOSURE_APERTURE_PRIORITY, 0, 3, V4L2_CTRL_TYPE_MENU}},
        {V4L2_CID_EXPOSURE_ABSOLUTE, {"Exposure Time, Absolute", 312, 1, 5000}},
        {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {"Exposure, Dynamic Framerate", 1, 0, 1, V4L2_CTRL_TYPE_BOOLEAN}},
        {V4L2_CID_CAMERA_CLASS, {"Camera Controls", 0, 0, 0, V4L2_CTRL_TYPE_CTRL_CLASS}}};
    camera.controls[V4L2_CID_EXPOSURE_AUTO].written = [this](std::int32_t) {
      camera.controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 157;
    };
    options.settle_s = 0.02;
    options.patience_s = 0;
  }

  static CameraSetting setting(const CameraSource& source, const std::string& name) {
    for (const CameraSetting& one : source.settings()) {
      if (one.name == name) return one;
    }
    ADD_FAILURE() << "no setting " << name;
    return {};
  }
  std::unique_ptr<CameraSource> open() { return open_camera(options, system); }
  std::string open_error() {
    return message_of([&] { open(); });
  }
  std::int32_t value(std::uint32_t id) { return camera.controls.at(id).value; }

  FakeCamera camera;
  detail::VideoSystem system = fake_system({&camera});
  CameraOptions options;
};

TEST_F(CameraControls, AutomaticsAreHeldAtWhatTheyHadFound) {
  const auto source = open();
  EXPECT_EQ(value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(value(V4L2_CID_EXPOSURE_ABSOLUTE), 312) << "not what was set by hand long ago";
  EXPECT_EQ(value(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  EXPECT_EQ(value(V4L2_CID_WHITE_BALANCE_TEMPERATURE), 5120);
  EXPECT_EQ(value(V4L2_CID_EXPOSURE_AUTO_PRIORITY), 0) << "the rate stays the rate";
  EXPECT_EQ(source->settings().size(), 7u) << "all that hold a number";
  EXPECT_EQ(setting(*source, "exposure_time_absolute").value, 312);
  EXPECT_TRUE(setting(*source, "exposure_time_absolute").locked);
  EXPECT_TRUE(setting(*source, "white_balance_automatic").locked);
  EXPECT_EQ(setting(*source, "gain").value, 3);
  EXPECT_EQ(source->warning(), "");
}

TEST_F(CameraControls, AutomaticsLookAtFramesBeforeTheyAreHeld) {
  for (int i = 0; i < 3; ++i) camera.frames.push_back({});
  const auto source = open();
  EXPECT_TRUE(camera.frames.empty()) << "seen, and not delivered";
  camera.frames.push_back({});
  EXPECT_EQ(source->next()->index, 0);
}

TEST_F(CameraControls, WhatTheDriverDoesNotLetGoStaysAutomaticAndIsSaid) {
  camera.controls[V4L2_CID_EXPOSURE_AUTO].refuses = EACCES;
  const auto source = open();
  EXPECT_EQ(source->warning(),
            "/dev/video0: auto_exposure stays automatic: the driver does not let it be held");
  EXPECT_FALSE(setting(*source, "auto_exposure").locked);
  EXPECT_FALSE(setting(*source, "exposure_time_absolute").locked) << "it still moves";
  EXPECT_TRUE(setting(*source, "white_balance_temperature").locked);
}

TEST_F(CameraControls, WantedValuesWin) {
  options.controls = {{"exposure_time_absolute", 99}, {"gain", 0}};
  const auto source = open();
  EXPECT_EQ(value(V4L2_CID_EXPOSURE_ABSOLUTE), 99);
  EXPECT_EQ(value(V4L2_CID_GAIN), 0);
  EXPECT_EQ(setting(*source, "exposure_time_absolute").value, 99);
}

TEST_F(CameraControls, WantedControlsThatCannotBeAreNamed) {
  options.controls = {{"exposure_time", 99}};
  EXPECT_THAT(open_error(), HasSubstr("/dev/video0: the camera has no control \"exposure_time\""));
  options.controls = {{"brightnes", 99}};
  EXPECT_THAT(open_error(), HasSubstr("did you mean brightness?"));
  options.controls = {{"zoom", 1}};
  EXPECT_THAT(open_error(), HasSubstr("but brightness, white_balance_automatic"));
  options.controls = {{"gain", 256}};
  EXPECT_EQ(open_error(), "/dev/video0: the camera does not take gain=256; its range is 0 to 255");
  options.controls = {{"gain", 1'000'000'000'000}};
  EXPECT_THAT(open_error(), HasSubstr("gain=1000000000000; its range is 0 to 255"));
  options.controls = {{"gain", 4}};
  camera.controls[V4L2_CID_GAIN].refuses = EINVAL;
  EXPECT_THAT(open_error(), HasSubstr("the camera does not take gain=4"));
  camera.controls.clear();
  EXPECT_THAT(open_error(), HasSubstr("no control \"gain\", nor any other"));
  EXPECT_EQ(camera.open_count, 0);
}

TEST(CameraOptions, AreReadFromTheProfile) {
  SensorProfile profile;
  profile.device_name = "DIGIT";
  profile.camera = "D20966";
  profile.camera_format = "YUYV";
  profile.camera_controls = " exposure_time_absolute = 120 ,gain=-3 ";
  profile.raw_width_px = 640;
  profile.raw_height_px = 480;
  profile.frame_rate_hz = 60;
  const CameraOptions options = camera_options(profile);
  EXPECT_EQ(options.device, "D20966");
  EXPECT_EQ(options.sensor, "DIGIT");
  EXPECT_EQ(options.encoding, FrameEncoding::yuyv);
  EXPECT_EQ(options.width_px, 640);
  EXPECT_EQ(options.height_px, 480);
  EXPECT_EQ(options.rate_hz, 60);
  using Controls = std::vector<std::pair<std::string, std::int64_t>>;
  EXPECT_EQ(options.controls, (Controls{{"exposure_time_absolute", 120}, {"gain", -3}}));
  EXPECT_TRUE(camera_options(SensorProfile()).controls.empty());
}

TEST(CameraOptions, WhatCannotBeReadIsNamed) {
  SensorProfile profile;
  profile.camera_format = "mjpeg";
  EXPECT_THAT(message_of([&] { camera_options(profile); }),
              HasSubstr("camera_format: \"mjpeg\" is neither MJPG nor YUYV"));
  profile.camera_format = "MJPG";
  for (const char* text :
       {"gain", "gain=", "=3", "gain=3x", "gain=3,", ",", "gain=99999999999999999999", "gain==3"}) {
    profile.camera_controls = text;
    EXPECT_THAT(message_of([&] { camera_options(profile); }), HasSubstr("is not name=number")) << text;
  }
}

}  // namespace
}  // namespace gelslam::test
