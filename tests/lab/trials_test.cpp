#include "protocols/trials.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"
#include "public_trial.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

std::string problem_with(const std::filesystem::path& folder) {
  return message_of([&] {
    for (const BenchmarkTrial& trial : find_trials({folder})) open_trial(trial.folder)->next();
  });
}

TEST(FindTrials, GoesIntoSubFoldersInNaturalOrder) {
  const TemporaryFolder data;
  for (const char* name : {"set/bead10", "set/bead2", "set/deep/er/key1", "single7"})
    write_public_trial(data / name, 1);
  std::filesystem::create_directories(data / "set/photos");
  write_public_trial(data / "set/1/2/3/4/too_deep", 1);
  const auto trials = find_trials({data / "set", data / "single7", data / "set/bead2"});
  ASSERT_EQ(trials.size(), 4U) << "what is named twice counts once";
  EXPECT_EQ(trials[0].name, "bead2");
  EXPECT_EQ(trials[0].object, "bead");
  EXPECT_EQ(trials[1].name, "bead10");
  EXPECT_EQ(trials[2].object, "key");
  EXPECT_EQ(trials[3].object, "single");
}

TEST(TrialFrames, AreThePublicArrays) {
  const TemporaryFolder data;
  write_public_trial(data / "bead1", 3, {1});
  const auto frames = open_trial(data / "bead1");
  for (int i = 0; i < 3; ++i) {
    const auto frame = frames->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->frame, i);
    EXPECT_NEAR(frame->time_s, i / 25.0, 1e-9);
    EXPECT_EQ(frame->start_T_frame.has_value(), i != 1);
    EXPECT_EQ(frame->surface->contact_pixels > 0, i != 1);
    if (i == 1) continue;
    EXPECT_TRUE(frame->start_T_frame->isApprox(place_of_frame(0).inverse() * place_of_frame(i), 1e-9));
    const SurfacePtr truth = surface_of_frame(i);
    EXPECT_LT(cv::norm(frame->surface->normals, truth->normals, cv::NORM_INF), 1e-5);
    cv::Mat1b beyond;
    cv::subtract(frame->surface->contact, truth->contact, beyond);
    EXPECT_EQ(cv::countNonZero(beyond), 0);
  }
  EXPECT_FALSE(frames->next());
}

TEST(TrialFrames, RefuseWhatDoesNotBelongTogether) {
  const TemporaryFolder data;
  const auto trial = data / "bead1";
  write_public_trial(trial, 2);
  const std::vector<float> one(120 * 160 * 2), no_pair(2 * 120 * 160);
  write_npy(trial / "gradient_maps.npy", {1, 120, 160, 2}, std::span<const float>(one));
  EXPECT_THAT(problem_with(data.path()), HasSubstr("N x H x W x 2")) << "the masks are still of two frames";
  write_npy(trial / "contact_masks.npy", {1, 120, 160}, std::vector<float>(120 * 160));
  EXPECT_THAT(problem_with(data.path()), HasSubstr("has 1 frames, but the truth has 2"));
  write_npy(trial / "gradient_maps.npy", {2, 120, 160}, std::span<const float>(no_pair));
  EXPECT_THAT(problem_with(data.path()), HasSubstr("N x H x W x 2"));
  write_bytes(trial / "gradient_maps.npy", "no array");
  EXPECT_THAT(problem_with(data.path()), HasSubstr("not a usable .npy"));
  std::filesystem::remove(trial / "gradient_maps.npy");
  EXPECT_NE(problem_with(data.path()), "nothing was thrown") << "neither arrays nor a video";
}

}  // namespace
}  // namespace gelslam
