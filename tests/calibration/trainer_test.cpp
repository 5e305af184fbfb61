#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../support/temporary_folder.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/surface/slopes.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;

GradientModel trained(const PressSet& set, const BallZones& zones, int steps, std::uint64_t seed) {
  NoProgress quiet;
  return train_model(set, zones.zones, {kPitchMm, seed, steps}, quiet);
}

/// A rough model of the labelled presses, trained once for what does not ask how well it was.
const GradientModel& rough_model() {
  static const GradientModel model = trained(forty_labelled(), zones_of_labelled(), 500, 1);
  return model;
}

class Stopping final : public ProgressSink {
 public:
  void begin(std::string_view, std::optional<std::int64_t>) override {}
  void update(std::int64_t) override { throw Error("stopped"); }
  void end() override {}
};

TEST(TrainModel, IsTheSameForTheSameSeed) {
  const PressSet& set = forty_labelled();
  const BallZones& zones = zones_of_labelled();
  const GradientModel a = trained(set, zones, 60, 7), b = trained(set, zones, 60, 7),
                      c = trained(set, zones, 60, 8);
  EXPECT_EQ(a, b);
  EXPECT_NE(a, c);
}

TEST(TrainModel, StopsWhenAskedAndRefusesTooLittle) {
  const PressSet& set = forty_labelled();
  BallZones zones = zones_of_labelled();
  NoProgress quiet;
  Stopping stopping;
  EXPECT_THAT(message_of([&] { train_model(set, zones.zones, {kPitchMm}, stopping); }),
              ::testing::HasSubstr("stopped"));
  zones.zones.resize(1);
  zones.zones[0].radius_px = 8.0;
  EXPECT_THAT(message_of([&] { train_model(set, zones.zones, {kPitchMm}, quiet); }),
              ::testing::HasSubstr("too few to train on"));
}

// Where no press was, the default stays; in the middle of the gel a model that was trained knows better.
TEST(HeldOutSigma, IsMeasuredWherePressesAreAndTheDefaultElsewhere) {
  const PressSet& set = forty_labelled();
  const BallZones& zones = zones_of_labelled();
  std::vector<BallZone> left;  // none on the right half of the gel
  for (const BallZone& zone : zones.zones)
    if (zone.u_px + zone.radius_px < 0.5 * set.background.cols) left.push_back(zone);
  ASSERT_GT(left.size(), 2U);
  NoProgress quiet;
  const std::vector<float> sigma =
      held_out_sigma_rad(train_halves(set, left, {kPitchMm, 1, 600}, quiet), set, kPitchMm);
  const cv::Mat1f standard = default_uncertainty(set.background.size(), kPitchMm).sigma_rad;
  ASSERT_EQ(sigma.size(), standard.total());
  int lower = 0;
  for (int row = 0; row < standard.rows; ++row)
    for (int column = 0; column < standard.cols; ++column) {
      const float measured = sigma[static_cast<std::size_t>(row * standard.cols + column)];
      if (2 * column >= standard.cols) {
        EXPECT_NEAR(measured, standard(row, column), 1e-4);
      } else {
        lower += measured < 0.8F * standard(row, column);
      }
    }
  EXPECT_GT(lower, 10);
}

// The balls of the forty alternate: halves by parity would be one ball each.
TEST(HeldOutSigma, HasBothBallsInBothHalvesHoweverTheyAlternate) {
  const PressSet& set = forty_labelled();
  const std::vector<BallZone>& zones = zones_of_labelled().zones;
  std::vector<BallZone> in_blocks = zones;
  std::ranges::stable_sort(in_blocks, {},
                           [&](const BallZone& zone) { return set.presses[zone.press].diameter_mm; });
  EXPECT_NE(zones[1].press, in_blocks[1].press);
  NoProgress quiet;
  const auto sigma = [&](const std::vector<BallZone>& of) {
    return held_out_sigma_rad(train_halves(set, of, {kPitchMm, 1, 40}, quiet), set, kPitchMm);
  };
  EXPECT_EQ(sigma(zones), sigma(in_blocks));
}

// Whatever a covered pixel shows: training and check are the same as with the gel there.
TEST(CoveredPixels, AreNeitherTrainedOnNorJudged) {
  PressSet set = labelled(simulated_presses(0, 12), 1.0, 4.0), spoiled = set;
  for (std::size_t k = 0; k < set.presses.size(); ++k) {
    cv::Mat1b covered(set.background.size(), static_cast<unsigned char>(0));
    for (int v = 8; v < covered.rows; v += 32)
      for (int u = 8; u < covered.cols; u += 32)
        covered(cv::Rect(u, v, 12, 12) & cv::Rect({}, covered.size())) = 255;
    set.presses[k].covered = spoiled.presses[k].covered = covered;
    spoiled.presses[k].bgr = set.presses[k].bgr.clone();
    spoiled.presses[k].bgr.setTo(cv::Scalar(200, 30, 90), covered);
  }
  const BallZones zones = find_ball_zones(set, kPitchMm, false);
  const GradientModel model = trained(set, zones, 60, 1);
  EXPECT_EQ(model, trained(spoiled, zones, 60, 1));
  for (const BallZone& zone : zones.zones) {
    const auto clean = read_zone(model, set, zone, kPitchMm),
               read = read_zone(model, spoiled, zone, kPitchMm);
    ASSERT_EQ(read.size(), clean.size());
    for (std::size_t k = 0; k < read.size(); ++k) {
      EXPECT_EQ(set.presses[zone.press].covered(read[k].v, read[k].u), 0);
      EXPECT_EQ(read[k].read, clean[k].read);
    }
  }
}

TEST(ModelCheck, NoticesAModelThatReadsTooSteep) {
  const PressSet& set = forty_labelled();
  const BallZones& zones = zones_of_labelled();
  const GradientModel& model = rough_model();
  GradientModel steep = model;
  for (float& weight : steep.weight(3)) weight *= 1.2F;
  for (float& bias : steep.bias(3)) bias *= 1.2F;
  const ModelCheck good = check_model({&model, 1}, set, zones.zones, kPitchMm),
                   bad = check_model({&steep, 1}, set, zones.zones, kPitchMm);
  EXPECT_NEAR(bad.slopes.all.scale() / good.slopes.all.scale(), 1.2, 0.03);
  EXPECT_EQ(bad.verdict, Verdict::recalibrate);
  // As halves read what they were not trained on.
  const ModelCheck in_turn = check_model(std::array{model, steep}, set, zones.zones, kPitchMm);
  for (std::size_t k = 0; k < in_turn.presses.size(); ++k)
    EXPECT_EQ(in_turn.presses[k].mean_abs_error_deg, (k % 2 ? bad : good).presses[k].mean_abs_error_deg) << k;
}

TEST(ModelCheck, SaysWhenAllPressesAreDeep) {
  constexpr double ball_px = 75.0;
  EXPECT_NEAR(rim_slope(ball_px * std::sin(0.5), ball_px), std::tan(0.5), 1e-9);
  EXPECT_EQ(missing_depths({0.65, 0.7, 0.8, 0.9, 1.0, 0.7, 0.8, 0.9, 0.5, 0.4}), "") << "two are lighter";
  const PressSet& set = forty_labelled();
  BallZones zones = zones_of_labelled();
  const GradientModel& model = rough_model();
  const auto asks_for_less = ::testing::Contains(HasSubstr("some less deep"));
  EXPECT_THAT(check_model({&model, 1}, set, zones.zones, kPitchMm).reasons, ::testing::Not(asks_for_less));
  for (BallZone& zone : zones.zones)
    zone.radius_px = 0.55 * 0.5 * set.presses[zone.press].diameter_mm / kPitchMm;  // 33 degrees
  EXPECT_THAT(check_model({&model, 1}, set, zones.zones, kPitchMm).reasons, asks_for_less);
}

}  // namespace
}  // namespace gelslam::test
