// Presses taken out of a stream of pictures of the simulator, which knows the truth.

#include "gelslam/calibration/press_collector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/simulation/press_log.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;

struct Film {
  std::vector<cv::Mat3b> frames;
  std::vector<SimulatedTouch> touches;
};

Film film(const PressLogSpec& spec) {
  Film result;
  result.touches =
      simulate_press_log(spec, [&](const cv::Mat3b& bgr) { result.frames.push_back(bgr.clone()); });
  return result;
}

/// Two good touches between each two mishaps, once each: made once for all tests.
const Film& mixed_film() {
  static const Film result = [] {
    PressLogSpec spec;
    spec.presses = 10;
    spec.mishaps = true;
    return film(spec);
  }();
  return result;
}

CollectorOptions ball(double diameter_mm) {
  CollectorOptions options;
  options.diameter_mm = diameter_mm;
  return options;
}

/// What came out, and after which frame.
struct Taken {
  CollectedPress press;
  int frame;
};

struct Watched {
  std::vector<Taken> taken;
  std::vector<std::string> warnings;  // by frame
  std::vector<CollectPhase> phases;   // by frame
};

Watched watch(PressCollector& collector, const std::vector<cv::Mat3b>& frames) {
  Watched watched;
  for (const cv::Mat3b& frame : frames) {
    if (auto press = collector.add(frame))
      watched.taken.push_back({*press, static_cast<int>(watched.phases.size())});
    watched.warnings.push_back(collector.status().warning);
    watched.phases.push_back(collector.status().phase);
  }
  return watched;
}

TEST(PressCollector, TakesEveryGoodTouchOnceAndNoBadOne) {
  const Film& log = mixed_film();
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, log.frames);
  std::size_t next = 0;
  for (const SimulatedTouch& touch : log.touches) {
    const bool taken = next < watched.taken.size() && watched.taken[next].frame > touch.first_frame &&
                       watched.taken[next].frame < touch.last_frame + 8;
    EXPECT_EQ(taken, touch.kind == TouchKind::good)
        << touch_kind_name(touch.kind) << " at frame " << touch.first_frame;
    if (!taken) continue;
    const ContactCircle& circle = watched.taken[next++].press.circle;
    // The finder's own accuracy at the border of the gel; in its middle it is a pixel or two.
    EXPECT_LT(std::hypot(circle.u_px - touch.center_px.x, circle.v_px - touch.center_px.y),
              0.25 * touch.radius_px);
    EXPECT_NEAR(circle.radius_px, touch.radius_px + 3.8, 5.0);
  }
  EXPECT_EQ(next, watched.taken.size());
  EXPECT_FALSE(collector.finish());
}

TEST(PressCollector, FindsCirclesThroughTheSensorsOptics) {
  PressLogSpec spec;
  spec.presses = 9;
  spec.geometry.optics = {0.045, {}, 1, 15, {}};  // touches have the ball's middle, which a dome shifts
  const Film log = film(spec);
  const auto mean_error_px = [&](const SensorOptics& optics) {
    CollectorOptions options = ball(spec.diameter_mm);
    options.optics = optics;
    PressCollector collector(options);
    const Watched watched = watch(collector, log.frames);
    EXPECT_EQ(watched.taken.size(), log.touches.size());
    double sum = 0;
    for (std::size_t k = 0; k < std::min(watched.taken.size(), log.touches.size()); ++k) {
      const ContactCircle& circle = watched.taken[k].press.circle;
      sum += std::hypot(circle.u_px - log.touches[k].center_px.x, circle.v_px - log.touches[k].center_px.y);
    }
    return sum / static_cast<double>(log.touches.size());
  };
  const double with = mean_error_px(spec.geometry.optics), without = mean_error_px({});
  EXPECT_LT(with, 0.8 * without) << with << " and " << without;
}

TEST(PressCollector, SaysWhatIsWrongWithEachBadTouch) {
  const Film& log = mixed_film();
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, log.frames);
  int seen = 0;
  for (const SimulatedTouch& touch : log.touches) {
    const char* words = touch.kind == TouchKind::sliding        ? "slides"
                        : touch.kind == TouchKind::too_deep     ? "too deep"
                        : touch.kind == TouchKind::too_shallow  ? "too shallow"
                        : touch.kind == TouchKind::off_the_gel  ? "too near the edge"
                        : touch.kind == TouchKind::two_contacts ? "two things touch"
                                                                : "";
    const auto last = static_cast<std::size_t>(touch.last_frame);
    EXPECT_THAT(watched.warnings[last], HasSubstr(words)) << touch.first_frame;
    EXPECT_EQ(watched.phases[last], *words == '\0' ? CollectPhase::taken : CollectPhase::pressing);
    // Said on, so that it can be read when the hand is off the gel.
    EXPECT_THAT(watched.warnings[last + 5], HasSubstr(words));
    seen += *words != '\0';
  }
  EXPECT_EQ(seen, 5);
}

TEST(PressCollector, WhatItKeepsHasLessNoiseThanAFrame) {
  const Film& log = mixed_film();
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, log.frames);
  const auto held = static_cast<std::size_t>(log.touches[0].first_frame);
  cv::Mat3f truth(log.frames[held].size(), cv::Vec3f(0, 0, 0));
  for (std::size_t k = held; k < held + 10; ++k) cv::add(truth, log.frames[k], truth, cv::noArray(), CV_32F);
  truth *= 0.1F;
  const auto noise = [&](const cv::Mat3b& picture) {
    cv::Mat3f precise;
    picture.convertTo(precise, CV_32F);
    return cv::norm(precise, truth, cv::NORM_L2);
  };
  // Six frames of ten: 0.27 of the noise if all else were equal; rounding and the shared frames blur that.
  EXPECT_LT(noise(watched.taken[0].press.bgr), 0.6 * noise(log.frames[held + 1]));
}

TEST(PressCollector, KeepsAPressThatIsHeldWhenThePicturesEnd) {
  const Film& log = mixed_film();
  PressCollector collector(ball(6.31));
  const int end = log.touches[0].last_frame;
  const Watched watched = watch(collector, {log.frames.begin(), log.frames.begin() + end});
  EXPECT_TRUE(watched.taken.empty());
  EXPECT_TRUE(collector.finish());
  EXPECT_FALSE(collector.finish());
}

TEST(PressCollector, WaitsUntilTheGelIsBare) {
  PressLogSpec spec;
  spec.presses = 2;
  spec.background_frames = 0;
  Film log = film(spec);
  const cv::Mat3b pressed = log.frames[static_cast<std::size_t>(log.touches[0].first_frame)];
  log.frames.insert(log.frames.begin(), 12, pressed);
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, {log.frames.begin(), log.frames.begin() + 12});
  EXPECT_TRUE(collector.background().empty());
  EXPECT_THAT(watched.warnings[9], HasSubstr("something lies on the gel"));
  // Held still from the first frame on, and then six bare frames between two touches: too few, still no
  // background.
  watch(collector, {log.frames.begin() + 12, log.frames.end()});
  EXPECT_TRUE(collector.background().empty());

  CollectorOptions blind = ball(6.31);
  blind.any_background = true;
  PressCollector believer(blind);
  watch(believer, {log.frames.begin(), log.frames.begin() + 12});
  EXPECT_FALSE(believer.background().empty());
}

TEST(PressCollector, MistrustsALightThatChanged) {
  const Film& log = mixed_film();
  PressCollector collector(ball(6.31));
  watch(collector, {log.frames.begin(), log.frames.begin() + 12});
  ASSERT_FALSE(collector.background().empty());
  std::vector<cv::Mat3b> brighter;
  for (int k = 12; k <= log.touches[0].last_frame + 5; ++k) {
    brighter.emplace_back();
    cv::add(log.frames[static_cast<std::size_t>(k)], cv::Scalar(9, 9, 9), brighter.back());
  }
  const Watched watched = watch(collector, brighter);
  EXPECT_THAT(watched.warnings[0], HasSubstr("the light has changed"));
  EXPECT_TRUE(watched.taken.empty());
}

TEST(PressCollector, RefusesPicturesThatCannotBelongTogether) {
  PressCollector collector(ball(6.31));
  EXPECT_THROW(collector.add(cv::Mat3b(60, 60)), Error);
  collector.add(cv::Mat3b(240, 320, cv::Vec3b(90, 100, 110)));
  EXPECT_THROW(collector.add(cv::Mat3b(120, 160)), Error);
  EXPECT_THROW(PressCollector(ball(0.0)), std::invalid_argument);
}

TEST(PressCollector, SurvivesPicturesOfNothing) {
  PressCollector collector(ball(6.31));
  cv::RNG random(1);
  for (int k = 0; k < 40; ++k) {
    cv::Mat3b noise(240, 320);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    EXPECT_FALSE(collector.add(k < 15 ? cv::Mat3b(240, 320, cv::Vec3b(0, 0, 0)) : noise));
  }
}

TEST(PressCoverage, SaysWherePressesAreMissing) {
  PressCoverage coverage(cv::Size(320, 240), 18);
  EXPECT_EQ(coverage.advice(), "press at the upper left (2 more there)");
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      for (int k = 0; k < (row == 1 && column == 2 ? 1 : 2); ++k)
        coverage.add({53.0 + 106.0 * column, 40.0 + 80.0 * row, 20.0});
  EXPECT_EQ(coverage.advice(), "press at the right (1 more there)");
  EXPECT_EQ(coverage.gaps(), "right (1)");
  coverage.add({-3.0, -3.0, 20.0});  // a middle outside the picture belongs to the nearest zone
  EXPECT_EQ(coverage.taken(0), 3);
  EXPECT_EQ(coverage.total(), 18);
  EXPECT_FALSE(coverage.enough());  // as many as wanted, but not everywhere
  coverage.add({319.4, 120.0, 20.0});
  EXPECT_TRUE(coverage.enough());
  EXPECT_EQ(coverage.advice(), "enough presses, all over the gel");
}

TEST(PressCoverage, WantsAtLeastOneEverywhere) {
  PressCoverage coverage(cv::Size(90, 90), 3);
  EXPECT_EQ(coverage.wanted(), 9);
  for (std::size_t zone = 0; zone < 9; ++zone) EXPECT_EQ(coverage.missing(zone), 1);
}

TEST(PressCoverage, WantsTheRestAnywhere) {
  PressCoverage coverage(cv::Size(90, 90), 11);
  for (int zone = 0; zone < 9; ++zone)
    coverage.add({15.0 + 30.0 * (zone % 3), 15.0 + 30.0 * (zone / 3), 9.0});
  EXPECT_EQ(coverage.advice(), "press anywhere (2 more)");
  EXPECT_EQ(coverage.gaps(), "");
}

}  // namespace
}  // namespace gelslam::test
