#include <cerrno>
#include <future>
#include <map>
#include <thread>
#include <utility>

#include "camera_fixture.hpp"

namespace gelslam::test {
namespace {

/// A camera that goes after two frames, and comes back when it was looked for `looks` times.
class AwayCamera : public Camera {
 protected:
  AwayCamera() {
    options.reconnect_timeout_s = 30;
    send(5, 5000);
    send(6, 5000.04);
    mini.frames.push_back({.code = ENODEV});
    // Its second frame was read when it is looked for.
    system.nodes = [this, nodes = system.nodes] {
      if (mini.calls.size() > 0 && opened) mini.open_fails = looks-- > 0 ? ENODEV : 0;
      if (opened && mini.open_fails == 0) come_back();
      return nodes();
    };
  }

  std::unique_ptr<CameraSource> open_and_read_two() {
    auto camera = open();
    opened = true;
    EXPECT_EQ(camera->next()->reconnects, 0);
    last = *camera->next();
    EXPECT_EQ(camera->disconnect_reason(), "");
    return camera;
  }
  void come_back() {
    if (moves) {
      mini.path = "/dev/video3";
      mini.bus = "usb-1";
    }
    mini.frames.clear();
    send(0, 5003.04);
    send(1, 5003.08);
    mini.frames[0].arrives_s = 3.04;
    mini.frames[1].arrives_s = 3.08;
    for (auto& [id, control] : mini.controls) control.value = at_power_on[id];
  }

  int looks = 2;
  bool opened = false, moves = true;
  RawFrame last;
  std::map<std::uint32_t, std::int32_t> at_power_on;
};

TEST_F(AwayCamera, IsOpenedAgainByItsNameWithItsSettings) {
  mini.controls = {
      {V4L2_CID_AUTO_WHITE_BALANCE, {"White Balance Automatic", 0, 0, 1, V4L2_CTRL_TYPE_BOOLEAN}},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {"White Balance Temperature", 4000, 2000, 7000}}};
  at_power_on = {{V4L2_CID_AUTO_WHITE_BALANCE, 1}, {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 2800}};
  const auto camera = open_and_read_two();
  const RawFrame back = *camera->next(), next = *camera->next();
  EXPECT_EQ(back.reconnects, 1);
  EXPECT_EQ(next.reconnects, 1);
  EXPECT_EQ(back.index, 2);
  EXPECT_NEAR(back.time_s, 3.04, 1e-5);
  EXPECT_NEAR(next.time_s, 3.08, 1e-5);
  EXPECT_EQ(back.unix_us - last.unix_us, 3'000'000);
  EXPECT_GT(back.sequence, last.sequence + 1) << "what it would have sent is lost";
  EXPECT_EQ(camera->lost_frames(), back.sequence - last.sequence - 1);
  EXPECT_EQ(next.sequence, back.sequence + 1);
  EXPECT_THAT(camera->warning(), testing::MatchesRegex("the camera was away for [0-9]\\.[0-9] s"));
  EXPECT_EQ(mini.controls[V4L2_CID_AUTO_WHITE_BALANCE].value, 0);
  EXPECT_EQ(mini.controls[V4L2_CID_WHITE_BALANCE_TEMPERATURE].value, 4000);
}

/// Who shows it asks from another thread (for the thread sanitizer).
TEST_F(AwayCamera, IsDescribedFromAnyThreadAsItWasOpened) {
  const auto camera = open_and_read_two();
  const std::string before = camera->description();
  std::atomic<bool> done = false;
  std::jthread asks([&] {
    while (!done) {
      EXPECT_EQ(camera->description(), before);
      camera->warning();
    }
  });
  EXPECT_EQ(camera->next()->reconnects, 1);
  EXPECT_EQ(camera->description(), before);
  done = true;
}

TEST_F(AwayCamera, AnotherOneIsNotTaken) {
  options.reconnect_timeout_s = 0.3;
  const auto camera = open_and_read_two();
  mini.card = "GelSight Mini R0B 1111";
  EXPECT_EQ(message_of([&] { camera->next(); }),
            "/dev/video0: the camera is gone; is it unplugged? (waited 0.3 s for it)");
}

TEST_F(AwayCamera, NobodyWaitsForItAfterStop) {
  looks = 1'000'000;
  const auto camera = open_and_read_two();
  auto reading = std::async(std::launch::async, [&] { return camera->next(); });
  while (camera->disconnect_reason().empty()) std::this_thread::yield();
  EXPECT_EQ(camera->disconnect_reason(), "connect it again within 30 s");
  camera->stop();
  EXPECT_FALSE(reading.get());
}

TEST_F(AwayCamera, OfTwoWithOneNameItIsTheOneAtItsPlace) {
  moves = false;
  FakeCamera twin;
  twin.path = "/dev/video1";
  twin.bus = "usb-elsewhere";
  auto both = fake_system({&twin, &mini});
  both.nodes = [this, nodes = both.nodes, watch = system.nodes] { return watch(), nodes(); };
  system = both;
  options.device = "/dev/video0";
  const auto camera = open_and_read_two();
  EXPECT_EQ(camera->next()->reconnects, 1);
  EXPECT_EQ(twin.open_count, 0);
  EXPECT_TRUE(mini.streaming);
}

}  // namespace
}  // namespace gelslam::test
