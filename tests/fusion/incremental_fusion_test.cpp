#include "gelslam/fusion/incremental_fusion.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>

#include "gelslam/core/error.hpp"
#include "mesh_checks.hpp"
#include "synthetic_touch.hpp"

namespace gelslam {
namespace {

using namespace test;  // NOLINT: the helpers of these tests

IncrementalOptions exact() {
  IncrementalOptions options;
  options.max_displacement_mm = options.max_scale_change = 0;
  return options;
}

FusionOptions with_debris() {
  FusionOptions options;
  options.threads = 1;
  options.min_shell_mm2 = 0;
  return options;
}

void expect_same_as_fuse(const Shown& shown, const std::vector<PosedSurface>& patches,
                         double gradient_scale) {
  const std::vector<Facet> wanted = facets_of(fuse(patches, with_debris(), gradient_scale)),
                           got = facets_of(shown);
  EXPECT_EQ(got.size(), wanted.size());
  EXPECT_TRUE(got == wanted);
}

const std::vector<PosedSurface>& peanut_patches() {
  static const auto patches = roll(pebble(), 10, 0.5, 0.6, kUsualErrors, 4);
  return patches;
}

PosedSurface disturbed(PosedSurface patch, std::mt19937& random, double rotation_rad, double translation_mm) {
  std::uniform_real_distribution<double> amount(-1, 1);
  Vector6d motion;
  for (int i = 0; i < 6; ++i) motion[i] = amount(random) * (i < 3 ? rotation_rad : translation_mm);
  patch.map_T_keyframe = patch.map_T_keyframe * se3_exp(motion);
  return patch;
}

class AnyHistory : public ::testing::TestWithParam<int> {};

TEST_P(AnyHistory, EndsWhereFuseDoes) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  const auto chance = [&](int one_in) { return random() % static_cast<unsigned>(one_in) == 0; };
  IncrementalOptions options = exact();
  if (GetParam() % 2 == 1) options.warm_blocks = 40;  // sums come and go
  IncrementalFusion fusion({}, options);
  Shown shown;
  std::map<int, PosedSurface> present;
  double scale = 1.0;
  for (int event = 0; event < 14; ++event) {
    for (const PosedSurface& patch : peanut_patches()) {
      if (!present.contains(patch.id)) {
        if (chance(3)) present[patch.id] = patch;
      } else if (chance(8)) {
        present.erase(patch.id);
      } else if (chance(4)) {
        present[patch.id] = disturbed(patch, random, 0.02, 0.2);
      }
    }
    if (chance(5)) scale = 0.95 + 0.01 * static_cast<double>(random() % 10);
    std::vector<PosedSurface> now;
    for (const auto& [id, patch] : present) now.push_back(patch);
    std::shuffle(now.begin(), now.end(), random);
    fusion.set_patches(now, scale);
    // Mostly the next change comes before this one is done.
    for (auto rounds = random() % 12; rounds > 0 && fusion.work(); --rounds) shown.take(fusion);
  }
  std::vector<PosedSurface> last;
  for (const auto& [id, patch] : present) last.push_back(patch);
  shown.finish(fusion);
  expect_same_as_fuse(shown, last, scale);

  shown.show(fusion, {}, scale);
  EXPECT_TRUE(shown.blocks().empty());
}

TEST(IncrementalFusion, FinishIsFuseToTheLastBitWhateverHappenedBefore) {
  const auto& patches = peanut_patches();
  constexpr double scale = 1.02;
  const FusionOptions options;
  const Mesh wanted = fuse(patches, options, scale);
  ASSERT_GT(wanted.triangles.size(), 1000u);
  std::mt19937 random(7);
  std::vector<PosedSurface> before;
  for (std::size_t i = 0; i < patches.size(); i += 2)
    before.push_back(disturbed(patches[i], random, 0.02, 0.2));
  before.push_back(patches.front());
  before.back().id = 1000;  // taken away again
  for (const int rounds : {0, 1, 3, 100000}) {
    IncrementalFusion fusion({}, exact());
    fusion.set_patches(before, 1.0);
    for (int round = 0; round < rounds && fusion.work(); ++round) continue;
    fusion.set_patches(patches, scale);
    const Mesh mesh = fusion.finish(2, options.min_shell_mm2);
    EXPECT_EQ(mesh.vertices_mm, wanted.vertices_mm) << rounds;
    EXPECT_EQ(mesh.confidence, wanted.confidence) << rounds;
    EXPECT_EQ(mesh.triangles, wanted.triangles) << rounds;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyHistory, ::testing::Values(1, 2, 3, 4));

TEST(IncrementalFusion, ThinPlatesKeepBothSidesAsInFuse) {
  const Field plate = slab({7, 5, 0.25}, 0.1);
  std::vector<PosedSurface> patches;
  std::mt19937_64 random(2);
  int id = 0;
  for (const double x : {-2.0, 2.0}) {
    for (const double side : {1.0, -1.0}) {
      patches.push_back(with_errors(id++, plate, press(plate, {0.1, 0.05, side}, 0.3, 0.1, {x, 0}),
                                    {0.003, 0.04, 0.03, 0.01}, random));
    }
  }
  IncrementalFusion fusion({}, exact());
  Shown shown;
  for (const std::size_t n : {2u, 4u, 3u}) {
    shown.show(fusion, {patches.begin(), patches.begin() + static_cast<std::ptrdiff_t>(n)}, 1.0);
  }
  patches.pop_back();
  expect_same_as_fuse(shown, patches, 1.0);
}

TEST(IncrementalFusion, BlocksMeetAtAnyTime) {
  // A row of patches on a ball is one sheet without holes. While they are moved, newest first, blocks of old
  // and of new places lie side by side: there is a step, small enough not to be taken for a wall, but no gap.
  std::vector<PosedSurface> patches;
  for (int i = 0; i < 5; ++i) {
    const Pose pose = press(kBall, {std::sin(0.35 * i), 0, std::cos(0.35 * i)}, 1.0, 0.0);
    patches.push_back({i, pose, measured(kBall, pose)});
  }
  IncrementalFusion fusion({}, exact());
  Shown shown;
  shown.show(fusion, patches, 1.0);
  ASSERT_EQ(topology(welded(shown)).euler_number, 1);
  for (PosedSurface& patch : patches) patch.map_T_keyframe.translation() += Eigen::Vector3d(0.01, 0.0, 0.02);
  fusion.set_patches(patches, 1.0);
  int states = 0;
  for (bool more = true; more;) {
    more = fusion.work();
    const int before = shown.changes();
    shown.take(fusion);
    if (shown.changes() == before) continue;
    ++states;
    const MeshTopology now = topology(welded(shown));
    EXPECT_EQ(now.pieces, 1);
    EXPECT_EQ(now.over_used_edges, 0);
    EXPECT_EQ(now.euler_number, 1);
  }
  EXPECT_GT(states, 2);  // it was really seen half done
  expect_same_as_fuse(shown, patches, 1.0);
}

TEST(IncrementalFusion, APatchChangesOnlyWhatIsAroundIt) {
  const auto& patches = peanut_patches();
  IncrementalFusion fusion({}, exact());
  Shown shown;
  shown.show(fusion, patches, 1.0);
  fusion.set_patches(patches, 1.0);
  EXPECT_FALSE(fusion.work());  // nothing new
  auto moved = patches;
  moved[4].map_T_keyframe.translation().x() += 0.05;
  fusion.set_patches(moved, 1.0);
  while (fusion.work()) continue;
  const auto changed = fusion.take_changed_blocks();
  EXPECT_GT(changed.size(), 20u);
  EXPECT_LT(changed.size(), shown.blocks().size() / 2);
  const Eigen::Vector3f center = patches[4].map_T_keyframe.translation().cast<float>();
  for (const MeshBlock& block : changed) {
    for (const auto& p : block.mesh.vertices_mm) EXPECT_LT((p - center).norm(), 9.0f);  // half a gel's width
  }
}

TEST(IncrementalFusion, SmallChangesAreLeftUntilTheyAddUp) {
  IncrementalOptions options;
  options.max_displacement_mm = 0.02;
  options.max_scale_change = 0.01;
  IncrementalFusion fusion({}, options);
  Shown shown;
  shown.show(fusion, {kPatch}, 1.0);
  const int before = shown.changes();

  const auto changes_after = [&](const PosedSurface& posed, double scale) {
    shown.show(fusion, {posed}, scale);
    return shown.changes() - before;
  };
  PosedSurface near = kPatch;
  near.map_T_keyframe.translation().z() += 0.015;
  EXPECT_EQ(changes_after(near, 1.0), 0);
  near.map_T_keyframe = kPressed * Eigen::AngleAxisd(0.0015, Eigen::Vector3d::UnitX());
  EXPECT_EQ(changes_after(near, 1.005), 0);
  near.map_T_keyframe = kPressed * Eigen::AngleAxisd(0.0025, Eigen::Vector3d::UnitX());
  EXPECT_GT(changes_after(near, 1.005), 0);
  expect_same_as_fuse(shown, {near}, 1.005);
  const int rotated = shown.changes();
  shown.show(fusion, {near}, 1.02);
  EXPECT_GT(shown.changes(), rotated);
  expect_same_as_fuse(shown, {near}, 1.02);
  // The same keyframe with another surface (an undone one's id, used again).
  PosedSurface other{1, near.map_T_keyframe, measured(sphere(5.0), press(sphere(5.0), {0, 0, 1}, 1.0, 0.0))};
  shown.show(fusion, {other}, 1.02);
  expect_same_as_fuse(shown, {other}, 1.02);
}

TEST(IncrementalFusion, VerticesNameTheKeyframeThatSeesThemBest) {
  const Pose left = press(kBall, {-0.35, 0, 1}, 1.0, 0.0), right = press(kBall, {0.35, 0, 1}, 1.0, 0.0);
  IncrementalFusion fusion({}, exact());
  fusion.set_patches({{12, left, measured(kBall, left)}, {7, right, measured(kBall, right)}}, 1.0);
  while (fusion.work()) continue;
  int seen = 0;
  for (const MeshBlock& block : fusion.take_changed_blocks()) {
    ASSERT_EQ(block.keyframe.size(), block.mesh.vertices_mm.size());
    for (std::size_t v = 0; v < block.keyframe.size(); ++v) {
      const float x = block.mesh.vertices_mm[v].x();
      if (std::fabs(x) < 0.3f) continue;  // both see it about as well
      EXPECT_EQ(block.keyframe[v], x < 0 ? 12 : 7) << x;
      ++seen;
    }
  }
  EXPECT_GT(seen, 3000);
}

TEST(IncrementalFusion, DamagedInputChangesNothing) {
  IncrementalFusion fusion({}, exact());
  Shown shown;
  shown.show(fusion, {kPatch}, 1.0);

  PosedSurface lost = kPatch;
  lost.map_T_keyframe.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fusion.set_patches({lost}, 1.0), Error);
  EXPECT_THROW(fusion.set_patches({{1, kPressed, {}}}, 1.0), Error);
  EXPECT_THROW(fusion.set_patches({kPatch, kPatch}, 1.0), Error);
  EXPECT_THROW(fusion.set_patches({}, 0.0), Error);
  EXPECT_THROW(fusion.set_patches({}, std::numeric_limits<double>::infinity()), Error);
  EXPECT_FALSE(fusion.work());
  expect_same_as_fuse(shown, {kPatch}, 1.0);

  // Too far away is found out only on the way there: the patch is left out, the others stay.
  PosedSurface far = kPatch;
  far.id = 2;
  far.map_T_keyframe.translation().x() = 1e9;
  fusion.set_patches({kPatch, far}, 1.0);
  EXPECT_THROW(while (fusion.work()) continue, Error);
  shown.finish(fusion);
  expect_same_as_fuse(shown, {kPatch}, 1.0);
  far.id = 1;  // and when a patch is sent there, it leaves its old place
  fusion.set_patches({far}, 1.0);
  EXPECT_THROW(while (fusion.work()) continue, Error);
  shown.finish(fusion);
  EXPECT_TRUE(shown.blocks().empty());

  FusionOptions options;
  options.voxel_size_mm = 0;
  EXPECT_THROW(IncrementalFusion(options, {}), Error);
}

}  // namespace
}  // namespace gelslam
