#include "gelslam/slam/trajectory_uncertainty.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gelslam {
namespace {

constexpr std::array<bool, 6> kAll = {true, true, true, true, true, true};
constexpr std::array<bool, 6> kNoSlideX = {false, true, true, true, true, true};

class Trajectory : public testing::Test {
 protected:
  void track(int frames, const std::array<bool, 6>& observable, int keyframe = 0) {
    for (int k = 0; k < frames; ++k, ++next_)
      records.push_back({next_, 0.04 * static_cast<double>(next_), TrackStatus::tracked, 0, keyframe,
                         Pose::Identity(), observable});
  }

  /// Returns the reported uncertainty if keyframe 0 is the anchor and keyframe 1 has these standard
  /// deviations.
  RunReport::Uncertainty uncertainty(double sigma_mm = 0, double sigma_rad = 0) const {
    MapSnapshot map;
    map.nodes = {{.keyframe = 0},
                 {.keyframe = 1, .covariance = covariance(sigma_mm, sigma_rad)},
                 {.keyframe = 2, .placed = false, .covariance = covariance(50, 1)}};
    return trajectory_uncertainty(records, map);
  }
  static Matrix6d covariance(double sigma_mm, double sigma_rad) {
    Vector6d sigma;
    sigma << sigma_rad, 0, 0, 0, sigma_mm, 0;
    return sigma.cwiseAbs2().asDiagonal();
  }

  std::vector<FrameRecord> records;

 private:
  std::int64_t next_ = 0;
};

TEST_F(Trajectory, IsQuietWhereAllWasObservableAndTheDriftIsSmall) {
  EXPECT_THAT(describe(RunReport::Uncertainty(), 20), testing::IsEmpty());
  track(30, kAll);
  track(30, kAll, 1);
  EXPECT_THAT(describe(uncertainty(0.4, 0.04), 20), testing::IsEmpty());
  EXPECT_NEAR(uncertainty(0.4, 0.04).drift_mm.amount, 0.8, 1e-9);
}

TEST_F(Trajectory, SaysTheLargestDriftAndWhereItIs) {
  track(30, kAll);
  track(30, kAll, 1);
  const RunReport::Uncertainty found = uncertainty(1.0, 0.2);
  EXPECT_NEAR(found.drift_mm.amount, 2.0, 1e-9);
  EXPECT_GE(found.drift_mm.frame, 30);
  EXPECT_NEAR(found.drift_deg.amount, 0.4 * kDegreesPerRadian, 1e-9);
  EXPECT_THAT(describe(found, 2.1),
              testing::ElementsAre("poses may be off by 2 mm and 23 degrees: return to where you began"));
  EXPECT_THAT(describe(found, 1.9), testing::ElementsAre(testing::EndsWith("23 degrees: press on texture")))
      << "nobody returns to a place that was never left";
  EXPECT_EQ(uncertainty(0, 7).drift_deg.amount, 180);
}

// In a scan with one keyframe, the drift is the uncertainty of the motion from that keyframe to the frames.
TEST_F(Trajectory, AFrameAddsItsOwnErrorToItsKeyframes) {
  track(40, kAll);
  EXPECT_EQ(uncertainty().drift_mm.amount, 0);
  const auto disturb_last = [&](int frames) {
    for (auto k = std::ssize(records) - frames; k < std::ssize(records); ++k)
      records[static_cast<std::size_t>(k)].covariance = covariance(0.3, 0.2);
  };
  disturb_last(2);
  EXPECT_EQ(uncertainty().drift_mm.amount, 0) << "for a moment";
  disturb_last(10);
  EXPECT_NEAR(uncertainty().drift_mm.amount, 0.6, 0.01);
  EXPECT_GE(uncertainty().drift_mm.frame, 30);
  EXPECT_NEAR(uncertainty().drift_deg.amount, 0.4 * kDegreesPerRadian, 1e-9);
  track(40, kAll, 1);
  disturb_last(10);
  EXPECT_NEAR(uncertainty(0.4, 0.1).drift_mm.amount, 1.0, 0.01);
  track(40, kAll, 2);
  disturb_last(40);
  EXPECT_NEAR(uncertainty(0.4, 0.1).drift_mm.amount, 1.0, 0.01) << "it is not in the map";
}

TEST_F(Trajectory, SaysWhatWasNotObservableOnceItHasLasted) {
  track(10, kAll);
  track(10, kNoSlideX);
  track(10, kAll);
  EXPECT_TRUE(uncertainty().not_observable.empty());
  track(40, kNoSlideX, 1);
  track(20, kAll, 1);
  const RunReport::Uncertainty found = uncertainty();
  ASSERT_EQ(found.not_observable.size(), 1u);
  EXPECT_EQ(found.not_observable[0].motion, "x");
  EXPECT_EQ(found.not_observable[0].first_frame, 30);
  EXPECT_EQ(found.not_observable[0].frames, 40);
  EXPECT_THAT(describe(found, 0),
              testing::ElementsAre(
                  "sliding along x is not observable in 40 frames, from 1.2 s on: press on texture"));
}

}  // namespace
}  // namespace gelslam
