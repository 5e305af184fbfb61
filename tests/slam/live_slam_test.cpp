#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/status_text.hpp"
#include "live_fixture.hpp"

namespace gelslam::test {
namespace {

TEST_F(Live, TheWindowSeesTheMeshGrowAndAtLastTheSavedOne) {
  std::size_t triangles_before_the_end = 0;
  source->before(kBackgroundFrames + kScanFrames - 1, [&] {
    EXPECT_TRUE(comes_true([&] {
      triangles_before_the_end = session->mesh()->whole().triangles.size();
      return triangles_before_the_end > 0;
    }));
    EXPECT_EQ(session->status().state, "tracking");
    EXPECT_EQ(session->status().track, TrackStatus::tracked);
    EXPECT_FALSE(session->map()->nodes.empty());
    EXPECT_EQ(session->map()->shown_component, 0);
  });
  const RunReport summary = start().wait();
  EXPECT_EQ(session->status().phase, LivePhase::finished);
  EXPECT_EQ(session->status().age_s, session->status().age_s);  // the clock has stopped
  EXPECT_EQ(session->mesh()->whole().triangles.size(), summary.mesh.triangles);
  EXPECT_GT(summary.mesh.triangles, 1000U);
}

TEST_F(Live, RecordsEveryFrameAlsoThoseItLeavesOut) {
  options.record = LogAttachments{};
  options.drop_when_behind = true;
  source->before(30, [&] { session->set_paused(true); });
  source->before(35, [&] { session->set_paused(false); });
  start().wait();
  const std::unique_ptr<RawFrameSource> log = open_raw_log(options.run_folder / "log.mkv");
  FrameDecoder decoder{SensorProfile{}};
  std::size_t frames = 0;
  for (std::optional<RawFrame> frame; (frame = log->next()); ++frames) {
    const std::size_t index = static_cast<std::size_t>(frame->sequence);
    const std::optional<TactileImage> image = decoder.decode(*frame);
    ASSERT_TRUE(image) << index;
    EXPECT_EQ(cv::norm(image->bgr, peanut_pictures()[index], cv::NORM_INF), 0) << index;
  }
  EXPECT_EQ(frames, peanut_pictures().size());
  EXPECT_GT(session->status().log_bytes, 0);
}

TEST_F(Live, WaitsForTheBareGel) {
  std::vector<cv::Mat3b> pictures(peanut_pictures().end() - 15, peanut_pictures().end());
  pictures.insert(pictures.end(), peanut_pictures().begin(), peanut_pictures().end());
  source = std::make_unique<Pictures>(pictures);
  source->before(15, [&] {
    EXPECT_TRUE(comes_true([&] { return session->status().state.find("take the object off") == 0; }));
    EXPECT_EQ(session->status().phase, LivePhase::background);
  });
  const RunReport summary = start().wait();
  EXPECT_GT(summary.frames.tracked, kScanFrames - 5);
  EXPECT_THAT(read("report.json"), HasSubstr("\"background\": 25"));
}

TEST_F(Live, ALostSourceEndsTheScanWithAllThatWasSeen) {
  source->before(40, [] { throw Error("the camera was unplugged"); });
  const RunReport summary = start().wait();
  EXPECT_THAT(summary.warnings, testing::Contains(HasSubstr("unplugged")));
  EXPECT_TRUE(summary.partial);
  EXPECT_EQ(summary.frames.total, 40);
  EXPECT_GT(summary.mesh.triangles, 1000U);
  EXPECT_TRUE(fs::exists(options.run_folder / "mesh.ply"));
}

TEST_F(Live, GoesOnAsANewTrialWhenTheCameraComesBackWithTheSameGel) {
  std::vector<cv::Mat3b> pictures = peanut_pictures();
  pictures.insert(pictures.end(), peanut_pictures().begin(), peanut_pictures().end());
  const int back = static_cast<int>(peanut_pictures().size());
  source = std::make_unique<Pictures>(pictures);
  source->resume(back);
  source->before(back + kBackgroundFrames / 2, [&] {
    EXPECT_TRUE(comes_true([&] { return session->status().phase == LivePhase::background; }));
  });
  const RunReport summary = start().wait();
  EXPECT_FALSE(summary.partial);
  EXPECT_EQ(summary.trials, 2);
  EXPECT_EQ(summary.frames.background, 2 * kBackgroundFrames);
  EXPECT_THAT(summary.warnings, testing::Not(testing::Contains(HasSubstr("came back"))));
}

/// The camera disappears again before the first of its new pictures have been compared with the background.
TEST_F(Live, ComparesNoPictureOfACameraThatCameBackWithTheOldBackground) {
  std::vector<cv::Mat3b> pictures = peanut_pictures();
  const int back = static_cast<int>(pictures.size()), again = 3;
  pictures.insert(pictures.end(), peanut_pictures().begin(), peanut_pictures().begin() + again);
  pictures.insert(pictures.end(), peanut_pictures().begin(), peanut_pictures().end());
  source = std::make_unique<Pictures>(pictures);
  source->resume(back);
  source->resume(back + again);
  EXPECT_EQ(start().wait().frames.background, 2 * kBackgroundFrames + again);
}

TEST_F(Live, EndsSavedWhenTheCameraComesBackWithAnotherGel) {
  std::vector<cv::Mat3b> pictures = peanut_pictures();
  for (const cv::Mat3b& picture : peanut_pictures()) {
    pictures.push_back(picture.clone());
    cv::Mat3b edge = pictures.back()(cv::Rect(20, 20, 120, 90));  // a patch of another color
    edge += cv::Scalar(60, -30, 0);
  }
  source = std::make_unique<Pictures>(pictures);
  source->resume(static_cast<int>(peanut_pictures().size()));
  const RunReport summary = start().wait();
  EXPECT_TRUE(summary.partial);
  EXPECT_THAT(summary.warnings, testing::Contains(HasSubstr("since the camera came back ")));
  EXPECT_GT(summary.frames.tracked, kScanFrames - 5);
  EXPECT_EQ(summary.trials, 1);
  EXPECT_TRUE(fs::exists(options.run_folder / "mesh.ply"));
}

TEST_F(Live, EndsItsLogBeforeTheDiskIsFull) {
  options.record = LogAttachments{};
  options.keep_free_bytes = std::int64_t{1} << 60;
  const RunReport summary = start().wait();
  EXPECT_THAT(summary.warnings, testing::Contains(testing::AllOf(HasSubstr("recording stopped after "),
                                                                 HasSubstr("is free on the disk"))));
  EXPECT_GT(summary.mesh.triangles, 1000U) << "the scan goes on";
}

TEST_F(Live, DamagedFramesAreLeftOutAndCounted) {
  for (const int frame : {20, 21, 33}) source->damage(frame);
  const RunReport summary = start().wait();
  EXPECT_EQ(session->status().damaged, 3);
  EXPECT_THAT(summary.warnings,
              testing::Contains(HasSubstr("left out 3 damaged pictures (the first: frame 20: ")));
  EXPECT_EQ(summary.frames.total, kBackgroundFrames + kScanFrames - 3);
  EXPECT_EQ(summary.components, 1);
}

TEST_F(Live, FramesThatComeTooFastAreDroppedWholeAndCounted) {
  options.drop_when_behind = true;
  const RunReport summary = start().wait();
  const LiveStatus status = session->status();
  EXPECT_EQ(status.frames, kBackgroundFrames + kScanFrames);
  EXPECT_GT(status.dropped, 0);  // pictures come faster than surfaces can be estimated
  EXPECT_EQ(summary.frames.total + status.dropped, status.frames);
  EXPECT_EQ(summary.frames.background, kBackgroundFrames) << "however fast they come";
  EXPECT_THAT(
      summary.warnings,
      testing::Contains(HasSubstr("dropped: this computer is too slow for the camera; reconstruct the")));
}

TEST_F(Live, APauseBreaksTheTrial) {
  source->before(30, [&] {
    wait_for_touch(29);
    session->set_paused(true);
    EXPECT_EQ(session->status().phase, LivePhase::paused);
  });
  source->before(40, [&] { session->set_paused(false); });
  const RunReport summary = start().wait();
  EXPECT_EQ(summary.frames.total, kBackgroundFrames + kScanFrames - 10);
  EXPECT_EQ(summary.trials, 2);
}

TEST_F(Live, ALogWaitsForTheEndOfAPause) {
  source->before(30, [&] {
    session->set_paused(true);
    EXPECT_EQ(session->status().phase, LivePhase::paused);
  });
  Pictures& pictures = *source;
  session = begin_live_scan(pace(std::move(source), Pace::as_taken), options);
  pictures.open();
  EXPECT_TRUE(comes_true([&] { return session->touch() && session->touch()->tracked.frame == 29; }));
  EXPECT_EQ(session->status().frames, 30) << "frame 30 waits";
  session->set_paused(false);
  const RunReport summary = session->wait();
  EXPECT_EQ(summary.frames.total, kBackgroundFrames + kScanFrames) << "none is left out";
  EXPECT_EQ(summary.trials, 1);
}

TEST_F(Live, ALogThatSomebodyRemovesIsMissed) {
  options.record = LogAttachments{};
  source->before(40, [&] {
    wait_for_touch(39);
    fs::remove(options.run_folder / "log.mkv");
  });
  const RunReport summary = start().wait();
  EXPECT_THAT(summary.warnings,
              testing::Contains(HasSubstr("log.mkv: recording stopped: somebody removed the log")));
  EXPECT_EQ(summary.frames.total, kBackgroundFrames + kScanFrames);
  EXPECT_TRUE(fs::exists(options.run_folder / "mesh.ply"));
}

TEST_F(Live, FramesWaitForTheWindow) {
  std::atomic<bool> shown{false};
  options.begins = [&shown] { return shown.load(); };
  Pictures& pictures = *source;
  session = begin_live_scan(pace(std::move(source), Pace::as_taken), options);
  pictures.open();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(session->status().frames, 0);
  EXPECT_EQ(session->status().phase, LivePhase::background);
  shown = true;
  EXPECT_EQ(session->wait().frames.total, kBackgroundFrames + kScanFrames);
}

TEST_F(Live, AnEndWithoutATouchIsNoSuccess) {
  const std::vector<cv::Mat3b>& pictures = peanut_pictures();
  const auto advice_after = [&](const std::vector<cv::Mat3b>& seen) {
    source = std::make_unique<Pictures>(seen);
    session.reset();
    options.overwrite = true;
    start().wait();
    const StateWords words = state_words(session->status(), false);
    EXPECT_EQ(words.tone, Tone::amber);
    return words.advice;
  };
  EXPECT_EQ(advice_after(std::vector<cv::Mat3b>(kBackgroundFrames + 1, pictures[0])),
            "Saved. Nothing was touched. Press the object on the gel.");
  EXPECT_EQ(
      advice_after({pictures.begin() + 30, pictures.end()}),
      "Saved. Nothing was touched, and the background was not measured. Begin with nothing on the gel, then "
      "press the object on it.");
}

}  // namespace
}  // namespace gelslam::test
