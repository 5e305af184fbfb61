#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>

#include "../support/temporary_folder.hpp"
#include "cameras/v4l2_camera.hpp"
#include "fake_camera.hpp"

namespace gelslam::test {
namespace {

/// A bench: a webcam, a GelSight Mini with its metadata node, and a DIGIT.
class CameraList : public testing::Test {
 protected:
  CameraList() {
    webcam.card = "HD Webcam";
    webcam.bus = "usb-1";
    webcam.modes = {{V4L2_PIX_FMT_YUYV, 640, 480, {30, 15}}, {V4L2_PIX_FMT_MJPEG, 1280, 720, {30}}};
    metadata.path = "/dev/video1";
    metadata.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    mini.path = "/dev/video2";
    mini.controls[V4L2_CID_GAIN] = {"Gain", 3};
    digit.path = "/dev/video10";
    digit.card = "DIGIT: DIGIT";
    digit.bus = "usb-4";
  }
  std::string find_error(const std::string& device, const std::string& sensor = "GelSight Mini") {
    return message_of([&] { find(device, sensor); });
  }
  std::string find(const std::string& device, const std::string& sensor = "GelSight Mini") {
    CameraOptions options;
    options.device = device;
    options.sensor = sensor;
    return detail::find_camera(options, fake_system(cameras));
  }

  FakeCamera webcam, metadata, mini, digit;
  std::vector<FakeCamera*> cameras{&webcam, &metadata, &mini, &digit};
};

TEST_F(CameraList, SaysWhatEachNodeIs) {
  webcam.holder = "cheese (pid 12)";
  digit.open_fails = EACCES;
  digit.group = "plugdev";
  const auto list = list_cameras(fake_system(cameras));
  ASSERT_EQ(list.size(), 4u);
  EXPECT_EQ(list[0].name, "HD Webcam");
  EXPECT_EQ(list[0].node, CameraNode::capture);
  EXPECT_EQ(list[0].sensor, "");
  EXPECT_EQ(list[0].in_use_by, "cheese (pid 12)");
  ASSERT_EQ(list[0].modes.size(), 2u);
  EXPECT_EQ(mode_text(list[0].modes[0]), "YUYV 640x480 at 30, 15 Hz");
  EXPECT_EQ(list[1].node, CameraNode::metadata);
  EXPECT_EQ(list[1].sensor, "") << "it has no pictures to look at";
  EXPECT_TRUE(list[1].modes.empty());
  EXPECT_EQ(list[2].sensor, "GelSight Mini");
  EXPECT_EQ(list[2].driver, "uvcvideo");
  EXPECT_EQ(list[2].bus, "usb-0000:00:14.0-2");
  EXPECT_EQ(mode_text(list[2].modes.at(0)), "MJPG 3280x2464 at 25 Hz");
  EXPECT_EQ(list[2].settings.at(0).name, "gain");
  EXPECT_EQ(list[3].node, CameraNode::unknown);
  EXPECT_THAT(list[3].problem, HasSubstr("permission denied; the camera belongs to the group plugdev"));
  for (const FakeCamera* camera : cameras) EXPECT_EQ(camera->open_count, 0);
}

TEST_F(CameraList, AutoTakesTheSensorOfTheConfiguration) {
  EXPECT_EQ(find("auto"), "/dev/video2");
  EXPECT_EQ(find("auto", "DIGIT"), "/dev/video10");
  EXPECT_EQ(find("", "GelSight Mini"), "/dev/video2");
  cameras = {&webcam, &digit};
  EXPECT_EQ(find("auto", "a gel of our own"), "/dev/video10") << "any known sensor";
}

TEST_F(CameraList, ANameWithinAWordIsNoSensor) {
  webcam.card = "DIGITAL MICROSCOPE";
  EXPECT_EQ(find("auto", "DIGIT"), "/dev/video10");
}

TEST_F(CameraList, CamerasAreFoundByPathNumberAndName) {
  EXPECT_EQ(find("/dev/v4l/by-id/x"), "/dev/v4l/by-id/x");
  EXPECT_EQ(find("12"), "/dev/video12");
  EXPECT_EQ(find("Webcam"), "/dev/video0");
  EXPECT_THAT(find_error("Kinect"),
              HasSubstr("no camera has \"Kinect\" in its name: there is /dev/video0 (HD Webcam)"));
  EXPECT_EQ(find_error("G"),
            "more than one camera has \"G\" in its name: there is /dev/video2 (GelSight Mini R0B 28KX), "
            "/dev/video10 (DIGIT: DIGIT); give more of the name, or the path")
      << "the metadata node is none";
}

TEST_F(CameraList, HostileNamesAndListsDoNoHarm) {
  webcam.card.assign("a\nb\033[31m").append(40, 'x');  // longer than the field, without a zero
  webcam.endless_lists = true;
  webcam.modes[0].fourcc = 0x01020304;
  webcam.modes[1].rates_hz = {0};
  cameras = {&webcam};
  const auto list = list_cameras(fake_system(cameras));
  EXPECT_EQ(list[0].name.size(), 32u);
  EXPECT_EQ(list[0].name.find_first_of("\n\033"), std::string::npos);
  EXPECT_EQ(list[0].modes.at(0).format, "????");
  EXPECT_LE(list[0].modes.size(), 64u * 128u);
  for (const CameraMode& mode : list[0].modes) {
    for (const double rate : mode.rates_hz) EXPECT_GT(rate, 0);
  }
}

}  // namespace
}  // namespace gelslam::test
