#include <algorithm>
#include <atomic>
#include <cerrno>
#include <future>
#include <thread>
#include <utility>

#include "camera_fixture.hpp"

namespace gelslam::test {
namespace {

/// The driver's stamps, on the system's clock as it was at first.
TEST_F(Camera, FramesHaveTheTimeOfTheirCaptureOnTheSystemsClock) {
  const double now_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  const double first_s = std::round(1e6 * (now_s - 0.5)) / 1e6;
  for (std::uint32_t i = 0; i < 4; ++i) send(i, first_s + 0.04 * i);
  const auto camera = open();
  for (int i = 0; i < 4; ++i) {
    const auto frame = camera->next();
    const std::int64_t stamp_us = std::llround(1e6 * (first_s + 0.04 * i));
    EXPECT_NEAR(static_cast<double>(frame->unix_us - mini.unix_offset_us - stamp_us), 0, 1.5) << i;
    EXPECT_NEAR(std::chrono::duration<double>(frame->age).count(), 0.5 - 0.04 * i, 0.3) << i;
  }
  EXPECT_EQ(camera->warning(), "");
}

TEST_F(Camera, AClockThatIsSetMovesNoTimesAndIsSaid) {
  const std::int64_t offset_us = mini.unix_offset_us;
  const auto camera = open();
  std::vector<std::int64_t> unix_us;
  for (std::uint32_t i = 0; i < 6; ++i) {
    if (i == 2) mini.unix_offset_us += 20'000;  // drawn near by the network's time
    if (i == 4) mini.unix_offset_us -= 3'600'000'000;
    send(i, 5000 + 0.04 * i);
    unix_us.push_back(camera->next()->unix_us - offset_us);
  }
  for (std::size_t i = 1; i < unix_us.size(); ++i)
    EXPECT_NEAR(static_cast<double>(unix_us[i] - unix_us[i - 1]), 40'000, 2) << i;
  EXPECT_EQ(camera->warning(), "the system's clock was set by -3600.0 s; times go on as they began");
}

TEST_F(Camera, FramesComeAsTheDriverSentThem) {
  for (std::uint32_t i = 0; i < 10; ++i) {
    send(7 + i, 5000.0 + 0.04 * i);
    mini.frames.back().bytes = {0xff, 0xd8, static_cast<std::uint8_t>(i), 0xff, 0xd9};
  }
  const auto before = std::chrono::steady_clock::now();
  const auto camera = open();
  for (std::uint8_t i = 0; i < 10; ++i) {  // more than there are buffers
    const auto frame = camera->next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->encoding, FrameEncoding::jpeg);
    EXPECT_THAT(frame->bytes, ElementsAre(0xff, 0xd8, i, 0xff, 0xd9));
    EXPECT_EQ(frame->width_px, 3280);
    EXPECT_EQ(frame->height_px, 2464);
    EXPECT_EQ(frame->index, i);
    EXPECT_EQ(frame->sequence, 7 + i);
    EXPECT_NEAR(frame->time_s, 0.04 * i, 1e-5);
    EXPECT_GE(frame->arrived, before);
    EXPECT_LE(frame->arrived, std::chrono::steady_clock::now());
  }
  EXPECT_EQ(camera->description(), "GelSight Mini R0B 28KX, /dev/video0, MJPG 3280x2464, 25 Hz");
  EXPECT_EQ(camera->rate_hz(), 25);
  EXPECT_EQ(camera->lost_frames(), 0);
  EXPECT_EQ(camera->warning(), "");
}

/// Frames arrive every 0.04 s, 30 ms after their capture. One stamp, the first too, is wrong by anything:
/// then only its own frame is less exact, and of a count that cannot be nothing is believed.
TEST_F(Camera, AWrongStampMovesNoLaterTimes) {
  for (const double off_s : {10.0, -10.0, 1e6, 0.9, -0.1})
    for (const std::size_t wrong : {0u, 5u}) {
      for (std::uint32_t i = 0; i < 20; ++i) {
        send(100 + i + (i == 8 ? 1u << 30 : 0) + (i > 14 ? 2 : 0), 5000 + 0.04 * i);
        mini.frames.back().arrives_s = 0.03 + 0.04 * i;
      }
      mini.frames[wrong].time_s += off_s;
      const auto camera = open();
      const std::int64_t first_us = camera->next()->unix_us;
      for (int i = 1; i < 20; ++i) {
        const RawFrame frame = *camera->next();
        // What is within a second is not seen: it may have been so. The wrong one itself came 30 ms later.
        const bool may_be = wrong == 0 ? std::abs(off_s) < 1 : off_s > 0 && off_s < 1;
        const double tolerance_s = may_be ? 0.9 : i == 5 ? 0.03 : 1e-5;
        EXPECT_NEAR(frame.time_s, 0.04 * i, 1e-6 + tolerance_s) << off_s << " " << wrong << " " << i;
        EXPECT_NEAR(static_cast<double>(frame.unix_us - first_us), 1e6 * frame.time_s, 2);
      }
      EXPECT_EQ(camera->lost_frames(), 2);
    }
}

/// A program that does not come to fetch them for 3 s finds four frames in the driver's queue.
TEST_F(Camera, FramesThatWaitHaveTheTimeOfTheirCapture) {
  for (std::uint32_t i = 0; i < 20; ++i) {
    const bool after = i > 9;
    send(after ? i + 71 : i, after ? 5002.84 + 0.04 * i : 5000 + 0.04 * i);
    mini.frames.back().arrives_s = i > 5 && !after ? 3.2 : mini.frames.back().time_s - 4999.97;
  }
  const auto camera = open();
  for (std::uint32_t i = 0; i < 20; ++i)
    EXPECT_NEAR(camera->next()->time_s, i > 9 ? 2.84 + 0.04 * i : 0.04 * i, 1e-5) << i;
  EXPECT_EQ(camera->lost_frames(), 71);
}

TEST_F(Camera, TheRateIsSetAfterTheFormat) {
  open();
  EXPECT_LT(first_call(VIDIOC_S_FMT), first_call(VIDIOC_S_PARM));
  EXPECT_LT(first_call(VIDIOC_S_PARM), first_call(VIDIOC_REQBUFS));
  EXPECT_EQ(std::count(mini.calls.begin(), mini.calls.end(), VIDIOC_QUERYBUF), 4);
}

TEST_F(Camera, GapsInTheSequenceAreLostFrames) {
  for (const std::uint32_t sequence : {4294967290u, 4294967293u, 1u, 2u, 0u, 1u}) send(sequence, 0);
  const auto camera = open();
  std::vector<std::int64_t> sequences, lost;
  for (int i = 0; i < 6; ++i) {
    sequences.push_back(camera->next()->sequence - 4294967290);
    lost.push_back(camera->lost_frames());
  }
  // Two are missing before the second, three across the wrap; a count that begins anew is no loss.
  EXPECT_THAT(sequences, ElementsAre(0, 3, 7, 8, 9, 10));
  EXPECT_THAT(lost, ElementsAre(0, 2, 5, 5, 5, 5));
}

TEST_F(Camera, DamagedAndEmptyFramesAreNotDelivered) {
  for (std::uint32_t i = 0; i < 5; ++i) send(i, i);
  mini.frames[1].flags |= V4L2_BUF_FLAG_ERROR;
  mini.frames[3].bytes.clear();
  const auto camera = open();
  std::vector<std::int64_t> sequences;
  for (int i = 0; i < 3; ++i) sequences.push_back(camera->next()->sequence);
  EXPECT_THAT(sequences, ElementsAre(0, 2, 4));
  EXPECT_EQ(camera->lost_frames(), 2);
  EXPECT_EQ(camera->warning(), "/dev/video0: 2 frames came damaged from the driver; check cable and port");
}

TEST_F(Camera, AnotherFormatThanAskedIsSaid) {
  mini.modes = {{V4L2_PIX_FMT_YUYV, 640, 480, {15, 30}}, {V4L2_PIX_FMT_YUYV, 1280, 720, {}}};
  EXPECT_EQ(open_error(),
            "/dev/video0: asked for MJPG 3280x2464, the driver gave YUYV 640x480; the camera offers YUYV "
            "640x480 at 30, "
            "15 Hz; YUYV 1280x720: see camera_format, raw_imgw and raw_imgh in device_config");
  mini.modes = {{V4L2_PIX_FMT_MJPEG, 1920, 1080, {30}}};
  EXPECT_THAT(open_error(), HasSubstr("asked for MJPG 3280x2464, the driver gave MJPG 1920x1080"));
  for (const auto& [width, height] : {std::pair{3264u, 2464u}, std::pair{3280u, 2448u}}) {
    mini.modes = {{V4L2_PIX_FMT_MJPEG, width, height, {}}};
    EXPECT_THAT(open_error(), HasSubstr("the driver gave MJPG " + std::to_string(width)));
  }
}

TEST_F(Camera, AnotherRateThanAskedIsAWarning) {
  mini.forced_rate_hz = 18.75;
  auto camera = open();
  EXPECT_EQ(camera->rate_hz(), 18.75);
  EXPECT_EQ(camera->warning(), "/dev/video0: asked for 25 Hz, the driver gives 18.75 Hz");
  camera.reset();
  mini.forced_rate_hz = -1;
  EXPECT_EQ(open()->warning(), "/dev/video0: the driver does not say its rate");
}

TEST_F(Camera, YuyvRowsComeWithoutGaps) {
  mini.modes = {{V4L2_PIX_FMT_YUYV, 4, 3, {60}}};
  mini.row_gap_bytes = 5;
  options.encoding = FrameEncoding::yuyv;
  options.width_px = 4;
  options.height_px = 3;
  std::vector<std::uint8_t> padded, expected;
  for (std::uint8_t row = 0; row < 3; ++row) {
    for (std::uint8_t i = 0; i < 13; ++i) {
      padded.push_back(i < 8 ? static_cast<std::uint8_t>(row * 10 + i) : 0xee);
      if (i < 8) expected.push_back(padded.back());
    }
  }
  send(0, 0);
  mini.frames.back().bytes.assign(padded.begin(), padded.end() - 6);  // torn: the last row is not all there
  send(1, 1);
  mini.frames.back().bytes.assign(padded.begin(), padded.end() - 5);  // no gap after the last row
  const auto camera = open();
  const auto frame = camera->next();
  EXPECT_EQ(frame->sequence, 1) << "the torn one is not delivered";
  EXPECT_EQ(frame->bytes, expected);
  EXPECT_THAT(camera->warning(), HasSubstr("1 frame came damaged"));
}

TEST_F(Camera, AMetadataNodeNamesTheOneWithThePictures) {
  FakeCamera pictures;
  pictures.path = "/dev/video1";
  mini.device_caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  options.device = "/dev/video0";
  EXPECT_THAT(open_error(),
              HasSubstr("carries only metadata of GelSight Mini R0B 28KX; see gelslam devices"));
  system = fake_system({&mini, &pictures});
  EXPECT_THAT(open_error(), HasSubstr("its pictures are at /dev/video1"));
}

TEST_F(Camera, ABusyCameraNamesItsHolder) {
  mini.fails[VIDIOC_REQBUFS] = EBUSY;
  EXPECT_EQ(open_error(), "/dev/video0: another program uses the camera; close it first");
  mini.holder = "cheese (pid 4711)";
  EXPECT_EQ(open_error(), "/dev/video0: cheese (pid 4711) uses the camera; close that program first");
}

TEST_F(Camera, ACameraThatIsBusyForAMomentIsAskedAgain) {
  options.patience_s = 30;
  for (const auto& [request, code] : std::map<unsigned long, int>{
           {VIDIOC_S_FMT, EINVAL}, {VIDIOC_REQBUFS, EBUSY}, {VIDIOC_STREAMON, EBUSY}}) {
    mini.fails = {{request, code}};
    mini.fails_times = {{request, 2}};
    send(3, 0);
    const auto camera = open();
    EXPECT_EQ(camera->next()->sequence, 3);
  }
}

TEST_F(Camera, GivesUpWhenAskedHoweverPatientItIs) {
  int asked = 0;
  options.gives_up = [&] { return ++asked > 3; };
  options.patience_s = options.settle_s = 1e6;
  mini.fails[VIDIOC_REQBUFS] = EBUSY;
  EXPECT_EQ(open_error(), "stopped while the camera was being opened; nothing was written");
  mini.fails.clear();
  asked = 0;
  mini.controls = {{V4L2_CID_AUTO_WHITE_BALANCE, {"White Balance", 1, 0, 1, V4L2_CTRL_TYPE_BOOLEAN}}};
  EXPECT_EQ(open_error(), "stopped while the camera was being opened; nothing was written");
  EXPECT_EQ(mini.controls[V4L2_CID_AUTO_WHITE_BALANCE].value, 1) << "left as it was found";
  options.settle_s = 0;
  asked = -1000;
  mini.frames = {{}, {}};
  const auto camera = open();
  const int asked_until_open = asked;
  EXPECT_TRUE(camera->next().has_value());
  EXPECT_EQ(asked, asked_until_open) << "not once it is open";
}

TEST_F(Camera, EveryFailureHasItsWords) {
  const std::map<int, const char*> words{
      {EACCES,
       "/dev/video0: permission denied; the camera belongs to the group video: sudo usermod -aG video $USER"},
      {ENODEV, "/dev/video0: the camera is gone; is it unplugged?"},
      {ENOSPC, "/dev/video0: not enough USB bandwidth; connect the camera to another port"},
      {EIO, "/dev/video0: the camera does not answer; unplug it and plug it in again"},
      {ENOMEM, "/dev/video0: cannot "}};
  options.device = "/dev/video0";
  for (const auto& [code, expected] : words) {
    for (const unsigned long request :
         {VIDIOC_QUERYCAP, VIDIOC_S_FMT, VIDIOC_REQBUFS, VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON}) {
      mini.fails = {{request, code}};
      EXPECT_THAT(open_error(), HasSubstr(expected)) << request;
    }
    mini.fails.clear();
    mini.open_fails = code;
    EXPECT_THAT(open_error(), HasSubstr(expected));
    mini.open_fails = 0;
    mini.map_fails = code;
    EXPECT_THAT(open_error(), HasSubstr(expected));
    mini.map_fails = 0;
  }
  mini.open_fails = EACCES;
  mini.group = "";
  EXPECT_EQ(open_error(), "/dev/video0: permission denied; check who may read and write it");
  mini.open_fails = 0;
  mini.fails = {{VIDIOC_QUERYCAP, ENOTTY}};
  EXPECT_EQ(open_error(), "/dev/video0: not a camera");
  options.device = "/dev/video9";
  EXPECT_EQ(open_error(), "/dev/video9: there is no such device; see gelslam devices");
  options.device = "/dev/video0";
  mini.fails.clear();
  mini.most_buffers = 1;
  EXPECT_EQ(open_error(), "/dev/video0: the driver gives only 1 buffers; two are needed");
}

TEST_F(Camera, ACameraThatIsPulledOutIsSaid) {
  send(0, 0);
  mini.frames.push_back({.code = ENODEV});
  EXPECT_EQ(reading_error(), "/dev/video0: the camera is gone; is it unplugged?");
  mini.frames = {{}, {.code = EIO}};
  EXPECT_EQ(reading_error(), "/dev/video0: the camera does not answer; unplug it and plug it in again");
}

TEST_F(Camera, ACameraThatStallsIsSaid) {
  send(0, 0);
  EXPECT_EQ(reading_error(),
            "/dev/video0: no frame for 0.05 s; unplug the camera and plug it in again, directly and into "
            "another port if "
            "this comes back");
}

TEST_F(Camera, StopEndsTheWaitFromAnotherThread) {
  options.timeout_s = 60;
  const auto camera = open();
  std::promise<void> waits;
  mini.polled = [&, said = false]() mutable {
    if (!std::exchange(said, true)) waits.set_value();
  };
  std::thread other([&] {
    waits.get_future().wait();
    camera->stop();
  });
  EXPECT_FALSE(camera->next().has_value());
  other.join();
  send(0, 0);
  EXPECT_FALSE(camera->next().has_value()) << "stopped is stopped";
}

TEST_F(Camera, AnotherSensorThanTheConfigurationsIsAWarning) {
  mini.card = "DIGIT: DIGIT";
  options.device = "/dev/video0";
  EXPECT_EQ(open()->warning(), "/dev/video0: this is a DIGIT, the configuration is for a GelSight Mini");
  mini.card = "HD Webcam";
  EXPECT_EQ(open()->warning(), "");
}

}  // namespace
}  // namespace gelslam::test
