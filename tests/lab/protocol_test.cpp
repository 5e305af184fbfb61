#include "protocols/protocol.hpp"

#include <gtest/gtest.h>

#include "protocols/benchmark.hpp"
#include "public_trial.hpp"

namespace gelslam {
namespace {

using namespace test;

bool holds(const std::vector<int>& list, int value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

/// Half a millimeter more at each call; no overlap at the calls in `lost`, no match at those in `doubted`.
struct Script {
  std::vector<int> lost, doubted;
  std::vector<Pose> starts;  ///< that the method was given
  int prepared = 0;
};

Registrar scripted(const std::shared_ptr<Script>& script) {
  return [=](SurfacePtr surface) {
    ++script->prepared;
    const auto answer = [=](const Surface&, const PosePrior& prior) {
      script->starts.push_back(prior.pose);
      const int call = static_cast<int>(script->starts.size());
      const bool lost = holds(script->lost, call);
      RegistrationResult result;
      result.status = lost || holds(script->doubted, call) ? RegistrationStatus::too_little_overlap
                                                           : RegistrationStatus::converged;
      result.shared_samples = lost ? 3 : 1000;
      result.target_T_reference = motion(0, 0, 0, -0.5 * call, 0);
      return result;
    };
    return PreparedReference{std::make_shared<const NormalFlowReference>(surface, NormalFlowOptions{}),
                             answer};
  };
}

TrialFrame frame_of(int i, bool touches = true) {
  static const SurfacePtr surface = surface_of_frame(0);
  static const auto nothing = std::make_shared<const Surface>();
  return {i, 0.04 * i, touches ? surface : nothing,
          touches ? std::optional(motion(0, 0, 0, 0.5 * i, 0)) : std::nullopt};
}

TEST(FrameZero, RegistersToTheFirstContactFromTheLastEstimate) {
  const auto script = std::make_shared<Script>();
  script->doubted = {2};
  MethodRun run(scripted(script), Protocol::frame0, {});
  run.add(frame_of(0, false));
  for (int i = 1; i < 5; ++i) run.add(frame_of(i));
  EXPECT_EQ(script->prepared, 1);
  ASSERT_EQ(run.estimates().size(), 4U) << "nothing before the first contact";
  EXPECT_EQ(run.estimates()[0].frame, 1);
  EXPECT_TRUE(run.estimates()[0].first_T_frame.isApprox(Pose::Identity()));
  for (int i = 0; i < 4; ++i) {
    const FrameEstimate& estimate = run.estimates()[static_cast<std::size_t>(i)];
    EXPECT_TRUE(estimate.true_first_T_frame.isApprox(motion(0, 0, 0, 0.5 * i, 0)))
        << "relative to the first contact";
    EXPECT_TRUE(estimate.first_T_frame.isApprox(estimate.true_first_T_frame))
        << "a doubted pose is judged all the same";
    EXPECT_EQ(estimate.tracked, i != 2);
  }
  ASSERT_EQ(script->starts.size(), 3U);
  EXPECT_TRUE(script->starts[2].isApprox(motion(0, 0, 0, -1.0, 0))) << "the start is the last estimate";
}

TEST(FrameZero, WithoutOverlapTheLastEstimateStays) {
  const auto script = std::make_shared<Script>();
  script->lost = {2};
  MethodRun run(scripted(script), Protocol::frame0, {});
  for (int i = 0; i < 4; ++i) run.add(frame_of(i));
  const auto& estimates = run.estimates();
  EXPECT_FALSE(estimates[2].tracked);
  EXPECT_TRUE(estimates[2].first_T_frame.isApprox(estimates[1].first_T_frame));
  EXPECT_TRUE(estimates[3].tracked);
  EXPECT_TRUE(estimates[3].first_T_frame.isApprox(motion(0, 0, 0, 1.5, 0)));
}

TEST(Keyframes, FollowTheTracker) {
  MethodRun run(make_normal_flow({}), Protocol::keyframes, {});
  for (int i = 0; i < 12; ++i)
    run.add({i, 0.04 * i, surface_of_frame(i), place_of_frame(3).inverse() * place_of_frame(i)});
  ASSERT_EQ(run.estimates().size(), 12U);
  for (const FrameEstimate& estimate : run.estimates()) {
    EXPECT_TRUE(estimate.tracked);
    expect_within(gap(estimate.first_T_frame, estimate.true_first_T_frame), 0.1, 0.03);
  }
}

TEST(Keyframes, AfterALossTrackingGoesOnFromTheLastEstimate) {
  MethodRun run(make_normal_flow({}), Protocol::keyframes, {});
  const auto place = [](int i) {  // a jump that nothing bridges after frame 3
    return (i < 4 ? Pose::Identity() : motion(0, 0, 0, 40, 30)) * place_of_frame(i);
  };
  // A new trial begins with the first frame after TrackerOptions::patience_s, 0.2 s after frame 3.
  for (int i = 0; i < 12; ++i) run.add({i, 0.04 * i, surface_at(place(i)), place(0).inverse() * place(i)});
  const auto& estimates = run.estimates();
  ASSERT_EQ(estimates.size(), 12U);
  EXPECT_TRUE(estimates[3].tracked);
  EXPECT_FALSE(estimates[4].tracked);
  EXPECT_TRUE(estimates[4].first_T_frame.isApprox(estimates[3].first_T_frame));
  EXPECT_TRUE(estimates[10].tracked);
  EXPECT_TRUE(estimates[11].tracked);
  const Pose step = estimates[10].first_T_frame.inverse() * estimates[11].first_T_frame;
  EXPECT_LT(gap(step, place(10).inverse() * place(11)).mm, 0.02);
}

}  // namespace
}  // namespace gelslam
