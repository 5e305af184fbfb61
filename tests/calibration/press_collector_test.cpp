// Presses taken out of a stream of pictures of the simulator, which knows the truth.

#include "gelslam/calibration/press_collector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A touch that no calibration can use.
struct BadTouch {
  const char* words;                      // that are said of it; "": a good one
  double x_mm, contact_mm, slide_mm = 0;  // per frame
  bool two = false;
  std::size_t last = 0;  // frame in which the ball is held
};

/// Good touches, then a bad one of each kind, and a good one again.
struct MixedFilm : Film {
  std::vector<BadTouch> bad = {{"slides", 0, 1.5, 0.25},
                               {"too deep", 0, 2.9},
                               {"too shallow", 0, 0.57},
                               {"too near the edge", SensorGeometry().half_width_mm() + 0.5, 1.5},
                               {"two things touch", -0.5 * SensorGeometry().half_width_mm(), 1.5, 0, true},
                               {"", 0, 1.5}};

  void add(const Optics& optics, BadTouch& touch) {
    constexpr double radius = 0.5 * 6.31, shares[] = {0.3, 0.7, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0.7, 0.3};
    const auto show = [&](const GelShape& gel) {
      frames.push_back(optics.render(gel, static_cast<std::int64_t>(frames.size()), false));
    };
    const GelShape rest = gel_at_rest(optics.gel_grid());
    double x_mm = touch.x_mm;
    for (const double share : shares) {
      const double depth_mm = share * touch.contact_mm * touch.contact_mm / radius;
      GelShape gel = press_ball(optics.gel_grid(), radius, x_mm, 0, depth_mm).gel;
      if (touch.two) {  // far apart: what each does to the gel adds up
        const GelShape other = press_ball(optics.gel_grid(), radius, -x_mm, 0, depth_mm).gel;
        gel.height_mm += other.height_mm - rest.height_mm;
        gel.slope += other.slope - rest.slope;
        cv::bitwise_or(gel.contact, other.contact, gel.contact);
      }
      show(gel);
      if (share == 1) touch.last = frames.size() - 1, x_mm += touch.slide_mm;
    }
    for (int bare = 0; bare < 6; ++bare) show(rest);
  }
};

/// Made once for all tests.
const MixedFilm& mixed_film() {
  static const MixedFilm result = [] {
    PressLogSpec spec;
    spec.presses = 10;
    MixedFilm mixed{film(spec)};
    const Optics optics({}, {});
    for (BadTouch& touch : mixed.bad) mixed.add(optics, touch);
    return mixed;
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

/// The radius was given as the diameter.
TEST(PressCollector, TakesNoPressesOfALargerBallThanWasSaid) {
  const MixedFilm& log = mixed_film();
  PressCollector collector(ball(0.5 * 6.31));
  const Watched watched = watch(collector, log.frames);
  EXPECT_LE(10 * watched.taken.size(), log.touches.size()) << "as many as may be that wide";
  EXPECT_THAT(watched.warnings, testing::Contains(HasSubstr("or a smaller ball than was said")));
}

TEST(PressCollector, TakesEveryGoodTouchOnceAndNoBadOne) {
  const MixedFilm& log = mixed_film();
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, log.frames);
  std::size_t next = 0;
  for (const SimulatedTouch& touch : log.touches) {
    const bool taken = next < watched.taken.size() && watched.taken[next].frame > touch.first_frame &&
                       watched.taken[next].frame < touch.last_frame + 8;
    EXPECT_THAT(watched.warnings[static_cast<std::size_t>(touch.last_frame) + 5], IsEmpty());
    EXPECT_TRUE(taken) << "at frame " << touch.first_frame;
    if (!taken) continue;
    const ContactCircle& circle = watched.taken[next++].press.circle;
    // The finder's own accuracy at the border of the gel; in its middle it is a pixel or two.
    EXPECT_LT(std::hypot(circle.u_px - touch.center_px.x, circle.v_px - touch.center_px.y),
              0.25 * touch.radius_px);
    EXPECT_NEAR(circle.radius_px, touch.radius_px + 3.8, 5.0);
  }
  EXPECT_EQ(next + 1, watched.taken.size()) << "one more after the bad ones";
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
  const MixedFilm& log = mixed_film();
  PressCollector collector(ball(6.31));
  const Watched watched = watch(collector, log.frames);
  for (const BadTouch& touch : log.bad) {
    EXPECT_THAT(watched.warnings[touch.last], HasSubstr(touch.words));
    EXPECT_EQ(watched.phases[touch.last], *touch.words ? CollectPhase::pressing : CollectPhase::taken);
    // Said on, so that it can be read when the hand is off the gel.
    EXPECT_THAT(watched.warnings[touch.last + 5], HasSubstr(touch.words));
  }
}

TEST(PressCollector, WhatItKeepsHasLessNoiseThanAFrame) {
  const MixedFilm& log = mixed_film();
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

}  // namespace
}  // namespace gelslam::test
