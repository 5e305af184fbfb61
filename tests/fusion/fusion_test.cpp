#include "gelslam/fusion/fusion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "gelslam/core/error.hpp"
#include "mesh_checks.hpp"
#include "synthetic_touch.hpp"

namespace gelslam {
namespace {

using namespace test;  // NOLINT: the helpers of these tests

PosedSurface shifted_along_sensor(PosedSurface patch, double distance_mm) {
  patch.map_T_keyframe.translation() += distance_mm * patch.map_T_keyframe.linear().col(2);
  return patch;
}

void expect_manifold(const Mesh& mesh) {
  const MeshTopology t = topology(mesh);
  EXPECT_EQ(t.over_used_edges, 0);
  EXPECT_EQ(t.inconsistent_edges, 0);
}

/// Share of triangles whose own normal points against their vertices'.
double flipped_share(const Mesh& mesh) {
  double flipped = 0;
  for (const auto& t : mesh.triangles) {
    const auto p = [&](int c) { return mesh.vertices_mm[static_cast<std::size_t>(t[c])]; };
    const Eigen::Vector3f n = (p(1) - p(0)).cross(p(2) - p(0));
    flipped += n.dot(mesh.normals[static_cast<std::size_t>(t[0])]) < 0;
  }
  return flipped / static_cast<double>(mesh.triangles.size());
}

TEST(Fusion, AnyNumberOfPatchesOfOnePlaceIsOne) {
  auto dent = std::make_shared<Surface>();
  dent->pixel_pitch_mm = 0.1;
  dent->height_mm = cv::Mat1f(32, 32, -0.3F);
  dent->normals = cv::Mat3f(32, 32, cv::Vec3f(0, 0, 1));
  dent->contact = cv::Mat1b(32, 32, uchar{255});
  dent->curvature = cv::Mat1f(32, 32, 0.0F);
  dent->contact_pixels = 32 * 32;
  std::vector<PosedSurface> patches{{0, Pose::Identity(), SurfacePtr(dent)}};
  FusionOptions coarse;
  coarse.voxel_size_mm = 0.3;
  const Mesh one = fuse(patches, coarse);
  while (patches.size() < 40000) {
    patches.push_back(patches.front());
    patches.back().id = static_cast<int>(patches.size());
  }
  const Mesh many = fuse(patches, coarse);
  ASSERT_FALSE(one.triangles.empty());
  ASSERT_EQ(many.vertices_mm.size(), one.vertices_mm.size());
  for (const Eigen::Vector3f& p : many.vertices_mm) ASSERT_NEAR(p.z(), -0.3F, 1e-3F);
}

TEST(Fusion, TwoPatchesOfASphereMakeOneSphere) {
  const Pose beside = press(kBall, {0.3, 0, 1}, 1.0, 0.9);
  const std::vector<PosedSurface> patches{kPatch, {2, beside, measured(kBall, beside)}};
  const Mesh mesh = fuse(patches, {});
  ASSERT_FALSE(mesh.triangles.empty());
  const MeshTopology t = topology(mesh);
  EXPECT_EQ(t.pieces, 1);
  expect_manifold(mesh);
  const Accuracy a = accuracy(mesh, kBall);
  EXPECT_LT(a.mean_mm, 0.002);  // exact heights: only interpolation between pixels is left
  EXPECT_LT(a.max_mm, 0.05);    // also where the mask takes in some of the gel's membrane rim
  EXPECT_LT(a.normal_mean_rad, 0.005);
  EXPECT_EQ(flipped_share(mesh), 0.0);
  ASSERT_EQ(mesh.normals.size(), mesh.vertices_mm.size());
  ASSERT_EQ(mesh.confidence.size(), mesh.vertices_mm.size());
  EXPECT_GE(*std::min_element(mesh.confidence.begin(), mesh.confidence.end()), 0.01f);
}

TEST(Fusion, PixelsWeighByTheirSlopeAndWhetherTheyWereRead) {
  const auto flat = [](float height_mm, float nz, unsigned char confidence) {
    auto surface = std::make_shared<Surface>();
    surface->height_mm = cv::Mat1f(60, 80, height_mm);
    surface->normals = cv::Mat3f(60, 80, cv::Vec3f(std::sqrt(1 - nz * nz), 0, nz));
    surface->contact = cv::Mat1b(60, 80, uchar{255});
    surface->confidence = cv::Mat1b(60, 80, confidence);
    surface->contact_pixels = 60 * 80;
    return SurfacePtr(surface);
  };
  const auto in_the_middle = [](const std::vector<PosedSurface>& patches) {
    const Mesh mesh = fuse(patches, {});
    const auto off_center = [](const Eigen::Vector3f& p) { return p.head<2>().norm(); };
    const auto i = std::ranges::min_element(mesh.vertices_mm, {}, off_center) - mesh.vertices_mm.begin();
    return std::pair(mesh.vertices_mm[static_cast<std::size_t>(i)].z(),
                     mesh.confidence[static_cast<std::size_t>(i)]);
  };
  const PosedSurface read{0, Pose::Identity(), flat(-0.3F, 1, 255)},
      filled_in{1, Pose::Identity(), flat(-0.2F, 1, 1)}, sloped{2, Pose::Identity(), flat(-0.3F, 0.8F, 255)};
  // Less 0.05, with which a pixel at the mask's border begins.
  EXPECT_NEAR(in_the_middle({read}).second, 0.95, 1e-3);
  EXPECT_NEAR(in_the_middle({sloped}).second, 0.8 * 0.8 - 0.05, 1e-3);
  EXPECT_NEAR(in_the_middle({filled_in}).second, 0.25, 1e-3);
  const auto [z, weight] = in_the_middle({read, filled_in});
  EXPECT_NEAR(weight, 0.95 + 0.25, 1e-3);
  EXPECT_NEAR(z, (0.95 * -0.3 + 0.25 * -0.2) / (0.95 + 0.25), 1e-3);
}

/// A dent that was filled in: it gives way to another touch, and leaves no hole where there is none.
TEST(Fusion, PixelsThatWereFilledInOnlyCloseTheHole) {
  const SurfacePtr whole = kPatch.surface.get();
  const auto dented = [&](unsigned char confidence) {
    auto surface = std::make_shared<Surface>(*whole);
    surface->height_mm = whole->height_mm.clone();
    surface->confidence = whole->contact.clone();
    const cv::Rect dot(cv::Point(whole->contact.cols / 2 - 5, whole->contact.rows / 2 - 5), cv::Size(10, 10));
    surface->height_mm(dot) -= 0.1;
    surface->confidence(dot).setTo(confidence);
    return SurfacePtr(surface);
  };
  const auto error_mm = [&](unsigned char confidence) {
    return accuracy(fuse({{0, kPressed, whole}, {1, kPressed, dented(confidence)}}, {}), kBall).max_mm;
  };
  EXPECT_LT(error_mm(1), 0.5 * error_mm(255));
  EXPECT_EQ(topology(fuse({{0, kPressed, dented(1)}}, {})).boundary_edges,
            topology(fuse({{0, kPressed, dented(255)}}, {})).boundary_edges);
  const auto left_out = [&](unsigned char confidence) {  // by the live window, for a smooth border
    const Mesh mesh = fuse({{0, kPressed, dented(confidence)}}, {});
    return std::count_if(mesh.confidence.begin(), mesh.confidence.end(), [](float c) { return c < 0.2F; });
  };
  EXPECT_EQ(left_out(1), left_out(255));
}

TEST(Fusion, PatchesOfANearCameraLieWhereTheObjectIs) {
  std::vector<PosedSurface> patches;
  for (const double aside_mm : {-6.0, 6.0}) {
    Pose pose = kPressed;
    pose.translation() += aside_mm * pose.linear().col(0);
    View view = everywhere();
    view.camera_distance_mm = 22;
    patches.push_back({static_cast<int>(patches.size()), pose, SurfacePtr(touch(kBall, pose, view))});
  }
  const Accuracy a = accuracy(fuse(patches, {}), kBall);
  EXPECT_LT(a.mean_mm, 0.003) << "0.27 mm aside without the camera's distance";
  EXPECT_LT(a.normal_mean_rad, 0.005);
}

TEST(Fusion, SheetsThatDisagreeBecomeOneInTheMiddle) {
  for (const double apart_mm : {0.1, 0.3, 0.7}) {
    const Mesh mesh =
        fuse({shifted_along_sensor(kPatch, apart_mm / 2), shifted_along_sensor(kPatch, -apart_mm / 2)}, {});
    EXPECT_EQ(topology(mesh).pieces, 1) << apart_mm;
    EXPECT_EQ(stacked_share(mesh, 1.0), 0.0) << apart_mm;
    EXPECT_LT(accuracy(mesh, kBall).max_mm, 0.01) << apart_mm;
  }
}

TEST(Fusion, AWronglyPlacedOverlapLeavesNoStep) {
  // Two patches side by side, half overlapping, 0.15 mm apart in depth: no triangle may stand up like a step.
  const Field plane_like = slab({30, 30, 5}, 1.0);
  std::vector<PosedSurface> patches;
  for (const double x : {-5.0, 5.0}) {
    const Pose pose = press(plane_like, {0, 0, 1}, 0.5, 0.0, {x, 0});
    patches.push_back(shifted_along_sensor({static_cast<int>(x), pose, measured(plane_like, pose)},
                                           x > 0 ? 0.075 : -0.075));
  }
  const Mesh mesh = fuse(patches, {});
  EXPECT_EQ(topology(mesh).pieces, 1);
  double steepest = 0;
  for (const auto& t : mesh.triangles) {
    const auto p = [&](int c) { return mesh.vertices_mm[static_cast<std::size_t>(t[c])]; };
    const Eigen::Vector3f n = (p(1) - p(0)).cross(p(2) - p(0)).normalized();
    steepest = std::max(steepest, std::acos(std::min(1.0, std::fabs(static_cast<double>(n.z())))));
  }
  // 0.15 mm over the tenth of the image (1.5 mm) in which a patch fades out is 0.1 rad; in the corners, where
  // both patches fade out, it is up to three times that. A step of one voxel would be 0.75.
  EXPECT_LT(steepest, 0.35);
}

TEST(Fusion, ARolledBallClosesWithoutADoubleSheet) {
  std::vector<PosedSurface> patches;
  std::mt19937_64 random(5);
  for (int i = 0; i < 30; ++i) {
    // A full turn and a bit: the end lies over the beginning, with the drift that is left after a loop.
    const double turn = 2.2 * std::numbers::pi * i / 30;
    patches.push_back(with_errors(i, kBall, press(kBall, {0, std::cos(turn), std::sin(turn)}, 1.0, 0.1 * i),
                                  kUsualErrors, random));
    patches.back() = shifted_along_sensor(patches.back(), 0.2 * i / 30);
  }
  const Mesh mesh = fuse(patches, {});
  EXPECT_EQ(topology(mesh).pieces, 1);
  expect_manifold(mesh);
  EXPECT_EQ(stacked_share(mesh, 1.0), 0.0);
  // Rolled about x: a closed ring has two rims; cutting it open anywhere would merge them to one.
  std::vector<Eigen::Vector3d> equator;
  for (int i = 0; i < 720; ++i) {
    const double a = 2 * std::numbers::pi * i / 720;
    equator.emplace_back(0, kRadiusMm * std::cos(a), kRadiusMm * std::sin(a));
  }
  EXPECT_EQ(covered_share(mesh, equator, 0.5), 1.0);
  EXPECT_LT(accuracy(mesh, kBall).mean_mm, 0.15);  // 0.2 mm drift, 0.08 mm and 3 % of 1 mm of noise
}

class ThinSlab : public ::testing::TestWithParam<double> {};

TEST_P(ThinSlab, KeepsBothSides) {
  const double thickness_mm = GetParam();
  const Field plate = slab({7, 5, thickness_mm / 2}, 0.1);
  std::vector<PosedSurface> patches;
  std::mt19937_64 random(2);
  int id = 0;
  for (const double x : {-2.0, 2.0}) {
    for (const double side : {1.0, -1.0}) {
      for (const double lean : {-0.1, 0.1}) {
        patches.push_back(with_errors(id++, plate, press(plate, {lean, 0.05, side}, 0.3, 0.3 * lean, {x, 0}),
                                      {0.003, 0.04, 0.03, 0.01}, random));
      }
    }
  }
  const Mesh mesh = fuse(patches, {});
  double up = 0, down = 0, top = 0, bottom = 0;
  for (std::size_t v = 0; v < mesh.normals.size(); ++v) {
    const double z = static_cast<double>(mesh.vertices_mm[v].z());
    if (mesh.normals[v].z() > 0.8f) {
      ++up;
      top += z;
    } else if (mesh.normals[v].z() < -0.8f) {
      ++down;
      bottom += z;
    }
  }
  ASSERT_GT(up, 1000);
  ASSERT_GT(down, 1000);
  EXPECT_GT(up + down, 0.99 * static_cast<double>(mesh.normals.size()));  // no walls between the sides
  EXPECT_NEAR(top / up, thickness_mm / 2, 0.05);                          // four patches a side, 0.04 mm each
  EXPECT_NEAR(bottom / down, -thickness_mm / 2, 0.05);
  EXPECT_LT(stacked_share(mesh, 0.3), 0.005);
  expect_manifold(mesh);
}

INSTANTIATE_TEST_SUITE_P(Thickness, ThinSlab, ::testing::Values(0.5, 1.0, 2.0));

TEST(Fusion, IsOpenWhereNothingTouched) {
  std::vector<PosedSurface> patches;
  for (const double side : {0.0, 1.0, 2.2}) {
    const Pose pose = press(kBall, {std::sin(side), 0, std::cos(side)}, 0.6, 0.0);
    patches.push_back({static_cast<int>(side * 10), pose, measured(kBall, pose)});
  }
  const Mesh mesh = fuse(patches, {});
  EXPECT_EQ(topology(mesh).pieces, 3);
  for (const auto& p : mesh.vertices_mm) {
    const bool touched = std::any_of(patches.begin(), patches.end(), [&](const PosedSurface& patch) {
      return (patch.map_T_keyframe.inverse() * p.cast<double>()).z() < 0.05;  // below the untouched gel
    });
    ASSERT_TRUE(touched) << p.transpose();
  }
  // And what was touched well inside of the mask is there.
  std::vector<Eigen::Vector3d> inner;
  for (const PosedSurface& patch : patches) {
    for (double a = 0; a < 6.28; a += 0.1) {
      const double r = std::sqrt(kRadiusMm * kRadiusMm - 5.4 * 5.4) - 0.8;  // 13 pixels in from the border
      inner.push_back(patch.map_T_keyframe * Eigen::Vector3d(r * std::cos(a), r * std::sin(a),
                                                             5.4 - std::sqrt(kRadiusMm * kRadiusMm - r * r)));
    }
  }
  EXPECT_EQ(covered_share(mesh, inner, 0.15), 1.0);
}

TEST(Fusion, GradientScaleIsTakenOut) {
  std::vector<PosedSurface> patches;
  for (const double side : {-0.1, 0.1}) {
    const Pose pose = press(kBall, {side, 0, 1}, 1.0, 0.0);
    auto surface = std::make_shared<Surface>(*measured(kBall, pose));
    surface->height_mm = surface->height_mm * 1.1;
    for (cv::Vec3f& n : surface->normals) n = cv::normalize(cv::Vec3f(n[0] * 1.1f, n[1] * 1.1f, n[2]));
    patches.push_back({patches.empty() ? 0 : 1, pose, SurfacePtr(surface)});
  }
  EXPECT_GT(accuracy(fuse(patches, {}), kBall).mean_mm, 0.03);
  const Accuracy a = accuracy(fuse(patches, {}, 1.1), kBall);
  EXPECT_LT(a.mean_mm, 0.002);
  EXPECT_LT(a.normal_mean_rad, 0.005);
}

TEST(Fusion, DoesNotDependOnThreads) {
  const auto patches = roll(pebble(), 8, 0.5, 0.6, kUsualErrors, 4);
  FusionOptions options;
  options.threads = 1;
  const Mesh one = fuse(patches, options);
  ASSERT_GT(one.triangles.size(), 1000u);
  for (const int threads : {2, 5}) {
    options.threads = threads;
    const Mesh many = fuse(patches, options);
    EXPECT_EQ(one.vertices_mm, many.vertices_mm);
    EXPECT_EQ(one.normals, many.normals);
    EXPECT_EQ(one.confidence, many.confidence);
    EXPECT_EQ(one.triangles, many.triangles);
  }
}

TEST(Fusion, MovesWithTheMap) {
  auto patches = roll(kBall, 6, 0.2, 0.8, {}, 4);
  const Mesh here = fuse(patches, {});
  Vector6d motion;
  motion << 0.7, -0.4, 1.1, 53.0, -41.0, 27.0;
  for (auto& patch : patches) patch.map_T_keyframe = se3_exp(motion) * patch.map_T_keyframe;
  const Mesh there = fuse(patches, {});
  EXPECT_NEAR(area_mm2(there), area_mm2(here), 0.01 * area_mm2(here));
  const Field moved = [&](const Eigen::Vector3d& p) {
    const auto [value, gradient] = kBall(se3_exp(motion).inverse() * p);
    return std::pair{value, Eigen::Vector3d(se3_exp(motion).linear() * gradient)};
  };
  EXPECT_LT(accuracy(there, moved).mean_mm, 0.002);
}

TEST(Fusion, DamagedInputIsNamedOrIgnored) {
  const SurfacePtr good = kPatch.surface.get();

  auto holes = std::make_shared<Surface>(*good);
  holes->height_mm = good->height_mm.clone();
  holes->normals = good->normals.clone();
  holes->height_mm(120, 160) = std::numeric_limits<float>::quiet_NaN();
  holes->normals(110, 150) = cv::Vec3f(0, 0, 0);
  const Mesh mesh = fuse({{0, kPressed, SurfacePtr(holes)}}, {});
  for (const auto& p : mesh.vertices_mm) ASSERT_TRUE(p.allFinite());
  EXPECT_LT(accuracy(mesh, kBall).mean_mm, 0.002);

  auto uneven = std::make_shared<Surface>(*good);
  uneven->height_mm = cv::Mat1f::zeros(10, 10);
  EXPECT_THROW(fuse({{0, kPressed, SurfacePtr(uneven)}}, {}), Error);
  EXPECT_THROW(fuse({{0, kPressed, {}}}, {}), Error);
  Pose lost = kPressed;
  lost.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(fuse({{0, lost, good}}, {}), Error);
  lost.translation().x() = 1e9;
  EXPECT_THROW(fuse({{0, lost, good}}, {}), Error);
  EXPECT_THROW(fuse({{0, kPressed, good}}, {}, 0), Error);

  for (const auto& spoil : std::vector<void (*)(FusionOptions&)>{
           [](FusionOptions& o) { o.voxel_size_mm = 0; }, [](FusionOptions& o) { o.truncation_mm = 0.01; },
           [](FusionOptions& o) { o.min_weight = -1; }}) {
    FusionOptions options;
    spoil(options);
    EXPECT_THROW(fuse({{0, kPressed, good}}, options), Error);
  }
}

TEST(Fusion, DebrisIsDropped) {
  auto surface = std::make_shared<Surface>(*kPatch.surface.get());
  surface->contact = surface->contact.clone();
  surface->contact(cv::Rect(0, 0, 320, 60)) = 0;
  surface->contact(cv::Rect(40, 30, 14, 14)) = 255;  // less than a square millimeter
  FusionOptions options;
  EXPECT_EQ(topology(fuse({{0, kPressed, SurfacePtr(surface)}}, options)).pieces, 1);
  options.min_shell_mm2 = 0;
  EXPECT_EQ(topology(fuse({{0, kPressed, SurfacePtr(surface)}}, options)).pieces, 2);
}

/// A second place that only one of two keyframes shows. Of a single touch all is kept.
TEST(Fusion, AnIslandOfOneKeyframeIsDroppedAndCounted) {
  auto both = std::make_shared<Surface>(*kPatch.surface.get());
  both->contact = both->contact.clone();
  both->contact(cv::Rect(0, 0, 320, 60)) = 0;
  both->contact.colRange(0, 140) = 0;
  both->contact(cv::Rect(10, 10, 60, 40)) = 255;
  std::int64_t islands = -1;
  EXPECT_EQ(topology(fuse({{0, kPressed, SurfacePtr(both)}, kPatch}, {}, 1.0, nullptr, &islands)).pieces, 1);
  EXPECT_EQ(islands, 1);
  EXPECT_EQ(topology(fuse({{0, kPressed, SurfacePtr(both)}}, {}, 1.0, nullptr, &islands)).pieces, 2);
  EXPECT_EQ(islands, 0);
}

/// Steps of voxels made the border of a round touch a quarter longer than that of a disk.
TEST(Fusion, TheBorderOfATouchIsSmooth) {
  const Pose pose = press(kBall, {0, 0, 1}, 0.7, 0.3);
  const Mesh mesh = fuse({{0, pose, measured(kBall, pose)}}, {});
  EXPECT_LT(topology(mesh).boundary_mm, 1.04 * std::sqrt(4 * M_PI * area_mm2(mesh)));
}

// Within 0.1 mm: kBeyondMm is 0.05 mm less than what fading takes, and a voxel has 0.06 mm.
TEST(Fusion, TheMeshEndsWhereTheContactEnds) {
  const Pose pose = press(kBall, {0, 0, 1}, 0.7, 0.3);
  const SurfacePtr surface = measured(kBall, pose);
  double farthest_mm = 0;
  for (const Eigen::Vector3f& p : fuse({{0, pose, surface}}, {}).vertices_mm)
    farthest_mm = std::max(farthest_mm, (pose.inverse() * p.cast<double>()).head<2>().norm());
  EXPECT_NEAR(farthest_mm, kPitchMm * std::sqrt(surface->contact_pixels / M_PI), 0.1);
}

TEST(Fusion, GapsBetweenCloseCrestsAreClosed) {
  for (const double gap_mm : {0.6, 1.2}) {
    auto bars = std::make_shared<Surface>();
    bars->height_mm = cv::Mat1f(120, 160, -0.3F);
    bars->normals = cv::Mat3f(120, 160, cv::Vec3f(0, 0, 1));
    bars->contact = cv::Mat1b(120, 160, uchar{255});
    const int gap_px = static_cast<int>(std::lround(gap_mm / bars->pixel_pitch_mm));
    bars->contact.colRange(80 - gap_px / 2, 80 - gap_px / 2 + gap_px) = 0;
    bars->contact_pixels = cv::countNonZero(bars->contact);
    const Mesh mesh = fuse({{0, Pose::Identity(), SurfacePtr(bars)}}, {});
    EXPECT_EQ(topology(mesh).pieces, gap_mm < 1 ? 1 : 2) << gap_mm;
  }
}

}  // namespace
}  // namespace gelslam
