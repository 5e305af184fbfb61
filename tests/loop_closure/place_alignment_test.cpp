#include <gtest/gtest.h>

#include <algorithm>

#include "gelslam/registration/verification.hpp"
#include "place_features.hpp"
#include "place_index.hpp"
#include "texture.hpp"

namespace gelslam {
namespace {

using namespace loop_closure::detail;
using namespace test;

// ---- features ----

// The features of a texture must be found at the same places if it is only a quarter as deep.
TEST(ExtractFeatures, FindsShallowTextureToo) {
  const int deep = extract_features(*feel(random_texture(6, 0.2), place(0, 0)), {}).size();
  const int shallow = extract_features(*feel(random_texture(6, 0.05), place(0, 0)), {}).size();
  EXPECT_GT(shallow, deep / 2);
}

TEST(ExtractFeatures, ASmoothSurfaceHasNone) {
  EXPECT_EQ(extract_features(*feel(plane(), place(0, 0)), {}).size(), 0);
  EXPECT_EQ(extract_features(*feel(random_texture(6, 0.002), place(0, 0)), {}).size(), 0);
  EXPECT_EQ(extract_features(*feel(random_texture(6), place(0, 0), {0, 0}), {}).size(), 0);
}

// ---- what two surfaces say about their overlap ----

TEST(Overlap, AgreesAtTheTrueTransformOnly) {
  const Field texture = random_texture(11);
  const Pose second = place(1.5, -0.4, 70, 3, 5);
  const SurfacePtr older = feel(texture, place(0, 0));
  const NormalFlowReference newer(feel(texture, second), {});
  const Pose truth = place(0, 0).inverse() * second;
  const RegistrationResult right = judge_pose(newer, *older, truth, {});
  EXPECT_TRUE(verify_registered(newer, *older, right, PlacePrior::unknown, {}).ok());
  EXPECT_TRUE(right.target_T_reference.isApprox(truth)) << "judged where it is";
  EXPECT_GT(right.information.determinant(), 0);
  EXPECT_GT(right.texture_correlation, 0.9);
  EXPECT_LT(right.height_rmse_mm, 0.01);
  EXPECT_GT(right.shared_samples, 1000);
  Pose shifted = truth;
  shifted.translation().x() += 0.6;
  const RegistrationResult wrong = judge_pose(newer, *older, shifted, {});
  EXPECT_LT(wrong.texture_correlation, 0.5);
  EXPECT_GT(wrong.height_rmse_mm, 5 * right.height_rmse_mm);
  EXPECT_FALSE(judge_pose(newer, *older, truth * motion(0, 0, 90, 0, 0), {}).ok());
  EXPECT_NEAR(judge_pose(newer, *older, motion(0, 0, 0, 0, 0, 0.3) * truth, {}).height_rmse_mm, 0.3, 0.01);
  Pose away = truth;
  away.translation().x() += 30;
  EXPECT_EQ(judge_pose(newer, *older, away, {}).shared_samples, 0);
}

// ---- repeated patterns ----

TEST(SelfSimilarity, TellsAPatternFromATexture) {
  EXPECT_GT(self_similarity(*feel(grid_texture(), place(0.3, 0.2, 20))), 0.95);
  EXPECT_LT(self_similarity(*feel(random_texture(3), place(0, 0))), 0.6);
  EXPECT_EQ(self_similarity(*feel(plane(), place(0, 0))), 0.0);
  EXPECT_EQ(self_similarity(*feel(grid_texture(), place(0, 0), {0, 0})), 0.0);
}

// ---- retrieval ----

PlaceFeatures random_features(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  PlaceFeatures features;
  for (int i = 0; i < count; ++i) {
    features.pixels.emplace_back(static_cast<float>(random() % 320), static_cast<float>(random() % 240));
    for (int k = 0; k < kDescriptorSize; ++k)
      features.descriptors.push_back(static_cast<std::uint8_t>(random() % 120));
  }
  return features;
}

TEST(PlaceIndex, RanksThePlaceSeenAgainFirstAmongHundreds) {
  PlaceIndex index;
  constexpr int kPlaces = 300;
  for (int i = 0; i < kPlaces; ++i) index.add(random_features(40 + i % 100, static_cast<std::uint64_t>(i)));
  std::mt19937_64 random(99);
  for (const int truth : {0, 150, 299}) {
    PlaceFeatures again = random_features(40 + truth % 100, static_cast<std::uint64_t>(truth));
    for (std::uint8_t& d : again.descriptors)
      d = static_cast<std::uint8_t>(std::max(0, d + static_cast<int>(random() % 21) - 10));
    EXPECT_EQ(index.most_alike(again, kPlaces, 20).front(), truth);
    const std::vector<int> searched_before = index.most_alike(again, truth, 20);
    EXPECT_EQ(std::count(searched_before.begin(), searched_before.end(), truth), 0);
  }
  EXPECT_TRUE(index.most_alike(random_features(5, 1), 0, 20).empty());
}

}  // namespace
}  // namespace gelslam
