#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {
namespace {

using namespace test;

constexpr int kWidthPx = 96, kHeightPx = 112;  // the contact in the middle of the picture
constexpr double kDepthMm = 0.8;

/// Returns the surface of a plane that rises along x, with contact in a rectangle of the picture.
SurfacePtr tilted(double tilt_deg, double camera_distance_mm = 0) {
  auto surface = std::make_shared<Surface>();
  const cv::Size size(320, 240);
  surface->pixel_pitch_mm = kPitchMm;
  surface->optics.camera_distance_mm = camera_distance_mm;
  surface->height_mm = cv::Mat1f(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->curvature = cv::Mat1f::zeros(size);
  surface->contact = cv::Mat1b::zeros(size);
  surface->contact(cv::Rect((320 - kWidthPx) / 2, (240 - kHeightPx) / 2, kWidthPx, kHeightPx)).setTo(255);
  const double slope = std::tan(tilt_deg * kDegree), inverse = surface->optics.inverse_distance();
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const double x = surface->camera().to_mm(cv::Point(u, v)).x();  // of the ray at z = 0
      surface->height_mm(v, u) = static_cast<float>((slope * x - kDepthMm) / (1 - slope * x * inverse));
    }
  return surface;
}

/// Returns a map of keyframes at the given positions along x of the plane.
MapSnapshot side_by_side(const SurfacePtr& surface, double tilt_deg, const std::vector<double>& along_mm) {
  MapSnapshot map;
  for (const double along : along_mm) {
    Pose pose = Pose::Identity();
    pose.translation() =
        along * Eigen::Vector3d(std::cos(tilt_deg * kDegree), 0, std::sin(tilt_deg * kDegree));
    map.nodes.push_back({.keyframe = static_cast<int>(map.nodes.size()),
                         .component_T_keyframe = pose,
                         .surface = StoredSurface(surface)});
  }
  map.shown_component = 0;
  return map;
}

/// Returns a mesh of the part of the plane with x below `end_mm`, in the frame of the sensor at the origin.
Mesh plane_until(double tilt_deg, double end_mm) {
  Mesh mesh;
  for (double x = -10; x < end_mm; x += 0.07)
    for (double y = -8; y < 8; y += 0.07)
      mesh.vertices_mm.emplace_back(
          Eigen::Vector3d(x, y, std::tan(tilt_deg * kDegree) * x - kDepthMm).cast<float>());
  return mesh;
}

RunReport::Touched touched(const MapSnapshot& map, const Mesh& mesh) { return touched_surface(map, mesh, 0); }

TEST(TouchedSurface, HasTheAreaOfATiltedPlaneHoweverOftenItIsShown) {
  for (const double tilt_deg : {0.0, 20.0, 40.0}) {
    const SurfacePtr surface = tilted(tilt_deg);
    const double width_mm = kWidthPx * kPitchMm / std::cos(tilt_deg * kDegree),
                 height_mm = kHeightPx * kPitchMm;
    for (const auto& along_mm : {std::vector{0.0}, {0.0, 1.3}, {0.0, 0.1, 0.2, 1.7, 2.6, 3.9}}) {
      const double expected_cm2 = 0.01 * (width_mm + along_mm.back()) * height_mm;
      const auto seen = touched(side_by_side(surface, tilt_deg, along_mm), {});
      // Where contacts end, points stand for squares of half a millimeter.
      EXPECT_NEAR(seen.area_cm2, expected_cm2, 0.04 * expected_cm2) << tilt_deg << " " << along_mm.size();
      EXPECT_EQ(seen.in_mesh_cm2, 0);
      EXPECT_EQ(seen.not_joined_cm2, 0);
    }
  }
}

/// A camera at a finite distance sees the two sides of a tilted plane under different angles.
TEST(TouchedSurface, FollowsTheRaysOfTheCamera) {
  constexpr double kDistanceMm = 22;
  for (const double tilt_deg : {-30.0, 0.0, 30.0}) {
    const SurfacePtr surface = tilted(tilt_deg, kDistanceMm);
    // The contact's corners on the plane, and the area of that trapezoid.
    const auto corner = [&](int u, int v) {
      const CameraModel camera = surface->camera();
      const Eigen::Vector2d rest_mm = camera.to_mm(Eigen::Vector2d(u - 0.5, v - 0.5));
      const double slope = std::tan(tilt_deg * kDegree), x = rest_mm.x();
      return camera.point_mm(rest_mm, (slope * x - kDepthMm) / (1 - slope * x / kDistanceMm));
    };
    const int left = (320 - kWidthPx) / 2, top = (240 - kHeightPx) / 2;
    const Eigen::Vector3d a = corner(left, top), b = corner(left + kWidthPx, top),
                          c = corner(left + kWidthPx, top + kHeightPx), d = corner(left, top + kHeightPx);
    const double expected_cm2 = 0.005 * ((c - a).cross(d - b)).norm();
    const auto seen = touched(side_by_side(surface, tilt_deg, {0}), {});
    EXPECT_NEAR(seen.area_cm2, expected_cm2, 0.01 * expected_cm2) << tilt_deg;
  }
}

TEST(TouchedSurface, SaysHowMuchOfItIsInTheMesh) {
  const SurfacePtr surface = tilted(20);
  const MapSnapshot map = side_by_side(surface, 20, {0, 0.8});
  const auto whole = touched(map, plane_until(20, 10));
  EXPECT_NEAR(whole.in_mesh_cm2, whole.area_cm2, 1e-9);
  const double from_mm = -0.5 * kWidthPx * kPitchMm, end_mm = 1;
  const auto part = touched(map, plane_until(20, end_mm));
  EXPECT_EQ(part.area_cm2, whole.area_cm2);
  EXPECT_NEAR(part.in_mesh_cm2, 0.01 * (end_mm - from_mm) / std::cos(20 * kDegree) * kHeightPx * kPitchMm,
              0.05 * whole.area_cm2);
}

TEST(TouchedSurface, ShowsWhereWhatIsNotInTheMeshLies) {
  const MapSnapshot map = side_by_side(tilted(20), 20, {2});
  std::vector<TouchedSquare> squares;
  const auto seen = touched_surface(map, plane_until(20, 2), 0, &squares);
  double area_cm2 = 0, from_mm = 1e9;
  for (const TouchedSquare& square : squares) {
    for (const Eigen::Vector3f& corner : square) {
      EXPECT_NEAR(corner.z(), std::tan(20 * kDegree) * corner.x() - kDepthMm, 1e-3) << "on the plane";
      from_mm = std::min<double>(from_mm, corner.x());
    }
    const Eigen::Vector3f normal = (square[2] - square[0]).cross(square[1] - square[0]);
    EXPECT_LT(normal.z(), 0) << "seen from outside, against the sensor's z";
    area_cm2 += 0.01 * normal.norm();
  }
  EXPECT_NEAR(area_cm2, seen.area_cm2 - seen.in_mesh_cm2, 1e-5);
  EXPECT_NEAR(from_mm, 2, 0.5);
  squares.clear();
  MapSnapshot elsewhere = map;
  elsewhere.nodes[0].placed = false;
  touched_surface(elsewhere, {}, 0, &squares);
  EXPECT_TRUE(squares.empty()) << "its place is not known";
}

TEST(TouchedSurface, OfAPieceThatIsNotJoinedNothingIsInTheMesh) {
  const SurfacePtr surface = tilted(0);
  MapSnapshot map = side_by_side(surface, 0, {0, 0, 2});
  const double patch_cm2 = 0.01 * kWidthPx * kHeightPx * kPitchMm * kPitchMm;
  map.nodes[1].component = 1;  // it is drawn there, but where it lies is not known
  map.nodes[1].placed = false;
  map.nodes[2].placed = false;  // as if it were a keyframe whose place in the map is not known
  const auto seen = touched(map, plane_until(0, 20));
  EXPECT_NEAR(seen.in_mesh_cm2, patch_cm2, 0.02 * patch_cm2);
  EXPECT_NEAR(seen.not_joined_cm2, patch_cm2 + 0.01 * 2 * kHeightPx * kPitchMm, 0.03 * patch_cm2);
  EXPECT_NEAR(seen.area_cm2, seen.in_mesh_cm2 + seen.not_joined_cm2, 1e-9);
}

}  // namespace
}  // namespace gelslam
