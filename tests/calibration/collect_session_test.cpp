// A session of `gelslam calibrate collect` that ends before its time: Ctrl-C, a camera that is pulled out, a
// gel that cannot be read. What was taken is kept, and the folder is whole.

#include "collect_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <mutex>
#include <new>
#include <utility>

#include "../sensor/raw_frames.hpp"
#include "../support/temporary_folder.hpp"
#include "camera_input.hpp"
#include "gelslam/calibration/label_session.hpp"
#include "gelslam/core/error.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDiameterMm = 6.31;

/// Three good presses, made once.
const Film& hand() {
  static const Film made = [] {
    PressLogSpec spec;
    spec.presses = 3;
    return film(spec);
  }();
  return made;
}

/// A camera that sends `count` pictures, and then does `at_the_end`, and then nothing: next() waits for
/// stop().
class WaitingCamera final : public RawFrameSource {
 public:
  WaitingCamera(std::vector<cv::Mat3b> pictures, std::function<void()> at_the_end)
      : pictures_(std::move(pictures)), at_the_end_(std::move(at_the_end)) {}

  std::optional<RawFrame> next() override {
    if (sent_ < pictures_.size()) {
      ++sent_;
      return bgr_frame(pictures_[sent_ - 1], static_cast<std::int64_t>(sent_));
    }
    at_the_end_();
    std::unique_lock lock(mutex_);
    stop_came_.wait(lock, [this] { return stopped_; });
    return std::nullopt;
  }
  void stop() override {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    stop_came_.notify_all();
  }
  double rate_hz() const override { return 25.0; }
  std::string description() const override { return "test"; }

 private:
  std::vector<cv::Mat3b> pictures_;
  std::function<void()> at_the_end_;
  std::size_t sent_ = 0;
  std::mutex mutex_;
  std::condition_variable stop_came_;
  bool stopped_ = false;
};

class EndOfACollection : public ::testing::Test {
 protected:
  /// Pictures until the ball of the last touch but one is held; and on to the middle of the last one's hold.
  static std::vector<cv::Mat3b> until_the_third_is_held() {
    const SimulatedTouch& third = hand().touches.at(2);
    const auto end = hand().frames.begin() + third.last_frame;
    return {hand().frames.begin(), end};
  }
  static void press_ctrl_c() { std::raise(SIGINT); }

  CollectSession session(RawFrameSource& source) const {
    CollectOptions options;
    options.folder = folder();
    options.diameter_mm = kDiameterMm;
    return {source, SensorProfile{}, PressFolder(folder(), kDiameterMm), options, [](const std::string&) {}};
  }
  fs::path folder() const { return place_ / "presses"; }
  void expect_whole(std::size_t presses) const {
    const PressSet set = read_press_set(folder());
    EXPECT_EQ(set.presses.size(), presses);
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder())) files += entry.is_regular_file();
    EXPECT_EQ(files, 2 + 2 * presses) << "background, catalog; of every press a picture and a label";
  }

  const TemporaryFolder place_;
};

TEST_F(EndOfACollection, CtrlCKeepsAllPressesAndTheOneStillHeld) {
  WaitingCamera camera(until_the_third_is_held(), press_ctrl_c);
  {
    CollectSession collecting = session(camera);
    const InterruptStopper stopper(InterruptWatch::Ends::regularly, [&] { collecting.stop(); });
    collecting.run();
    EXPECT_EQ(collecting.taken_now(), 3);
    EXPECT_THAT(collecting.summary(), HasSubstr("3 presses taken, 3 of 50 wanted"));
  }
  expect_whole(3);
  EXPECT_EQ(PressFolder(folder(), kDiameterMm).earlier().presses.size(), 3U) << "it can go on";
}

TEST_F(EndOfACollection, SaysWhenAllPressesAreOfOneDepth) {
  const auto summary_with = [&](double radius_px, std::size_t presses) {
    WaitingCamera camera({}, [] {});
    CollectSession collecting = session(camera);
    std::vector<ContactCircle> contacts;
    for (std::size_t k = 0; k < presses; ++k)
      contacts.push_back({30.0 + 25.0 * static_cast<double>(k), 120.0, radius_px});
    collecting.count(contacts);
    return collecting.summary();
  };
  EXPECT_THAT(summary_with(40.0, 9), HasSubstr("press some less deep"));
  EXPECT_THAT(summary_with(16.0, 9), HasSubstr("press deeper"));
  EXPECT_THAT(summary_with(25.0, 9), Not(HasSubstr("press ")));
  EXPECT_THAT(summary_with(40.0, 8), Not(HasSubstr("less deep"))) << "too few to tell";
}

TEST_F(EndOfACollection, ACameraThatIsPulledOutLosesNoPress) {
  WaitingCamera camera(until_the_third_is_held(),
                       [] { throw Error("the camera is gone; is it unplugged?"); });
  CollectSession collecting = session(camera);
  EXPECT_THAT(message_of([&] { collecting.run(); }), HasSubstr("the camera is gone"));
  EXPECT_EQ(collecting.taken_now(), 3) << "the one still held, too";
  expect_whole(3);
}

TEST_F(EndOfACollection, NoOtherMistakeLosesAPress) {
  WaitingCamera camera(until_the_third_is_held(), [] { throw std::bad_alloc(); });
  CollectSession collecting = session(camera);
  EXPECT_THROW(collecting.run(), std::bad_alloc);
  expect_whole(3);
}

TEST_F(EndOfACollection, AGelWithTooManyMarkersIsRefusedBeforeAnythingIsWritten) {
  std::vector<cv::Mat3b> dotted;
  for (int k = 0; k < 12; ++k) {
    cv::Mat3b picture = hand().frames.front().clone();
    for (int v = 20; v < picture.rows; v += 20)
      for (int u = 20; u < picture.cols - 8; u += 20)
        picture(cv::Rect(u - 4, v - 4, 9, 9)) = cv::Vec3b(15, 15, 15);
    dotted.push_back(picture);
  }
  WaitingCamera camera(dotted, [] { FAIL() << "it went on"; });
  CollectSession collecting = session(camera);
  const std::string message = message_of([&] { collecting.run(); });
  EXPECT_THAT(message, HasSubstr("markers"));
  EXPECT_FALSE(fs::exists(folder()));
}

}  // namespace
}  // namespace gelslam::test
