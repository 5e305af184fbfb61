// Tests what a stream reports about frames, and the poses of frames in the map.

#include "gelslam/slam/frame_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "gelslam/core/trajectory.hpp"

namespace gelslam {
namespace {

using nlohmann::json;

Pose any_pose(std::mt19937& random) {
  std::normal_distribution<double> number(0.0, 1.0);
  Vector6d xi;
  for (double& x : xi) x = number(random);
  return se3_exp(xi);
}

/// Returns a surface with a contact on the pixels [u0, u1) x [v0, v1), 0.1 mm deep.
SurfacePtr pressed(int u0, int v0, int u1, int v1) {
  auto surface = std::make_shared<Surface>();
  surface->contact = cv::Mat1b(240, 320, static_cast<unsigned char>(0));
  surface->contact(cv::Rect(u0, v0, u1 - u0, v1 - v0)) = 255;
  surface->height_mm = cv::Mat1f(240, 320, 0.0F);
  surface->height_mm.setTo(-0.1F, surface->contact);
  surface->contact_pixels = (u1 - u0) * (v1 - v0);
  return surface;
}

std::shared_ptr<const Keyframe> keyframe(int id, int trial) {
  return std::make_shared<const Keyframe>(Keyframe{id, 10 * id, trial, pressed(0, 0, 40, 40), {}});
}

TrackedFrame tracked(std::int64_t frame, const std::shared_ptr<const Keyframe>& reference,
                     const Pose& trial_T_keyframe, const Pose& keyframe_T_frame) {
  TrackedFrame result;
  result.frame = frame;
  result.time_s = 0.04 * static_cast<double>(frame);
  result.status = TrackStatus::tracked;
  result.trial = reference->trial;
  result.keyframe = reference;
  result.keyframe_T_frame = keyframe_T_frame;
  result.trial_T_frame = trial_T_keyframe * keyframe_T_frame;
  return result;
}

MapSnapshot::Node node(const std::shared_ptr<const Keyframe>& keyframe, int component,
                       const Pose& component_T_keyframe) {
  return {keyframe->id, keyframe->frame, keyframe->trial, component, component_T_keyframe};
}

TEST(NdjsonLine, StatesPoseCovarianceAndContactInTheirUnits) {
  std::mt19937 random(1);
  const SurfacePtr surface = pressed(100, 50, 140, 70);
  TrackedFrame frame = tracked(7, keyframe(3, 2), any_pose(random), any_pose(random));
  frame.registration.observable = {true, true, false, true, true, true};
  Matrix6d root;
  for (double& number : root.reshaped()) number = 0.01 * std::normal_distribution<double>()(random);
  const Matrix6d covariance = root * root.transpose();
  frame.unix_us = 1764268461123457;
  Matrix6d rotation_first;
  rotation_first << covariance.bottomRightCorner<3, 3>(), covariance.bottomLeftCorner<3, 3>(),
      covariance.topRightCorner<3, 3>(), covariance.topLeftCorner<3, 3>();
  const MapPlace in_trial{{frame.trial_T_frame, rotation_first}, 0};
  const MapPlace place{{any_pose(random), 4 * rotation_first}, 1};
  const std::string line =
      ndjson_line({.tracked = frame, .surface = surface, .in_trial = in_trial, .in_map = place}, 4);
  ASSERT_EQ(line.find('\n'), line.size() - 1);
  const json object = json::parse(line);
  EXPECT_EQ(object.at("type"), "frame");
  EXPECT_EQ(object.at("scan"), 4);
  EXPECT_EQ(object.at("keyframe"), 3);
  EXPECT_EQ(object.at("component"), 1);
  EXPECT_THAT(line, testing::HasSubstr("\"time_unix_s\":1764268461.123457,"));
  EXPECT_EQ(object.at("observable"), json({1, 1, 0, 1, 1, 1}));
  for (const auto& [key, pose] :
       {std::pair<const char*, Pose>{"pose", frame.trial_T_frame}, {"map_pose", place.map_T_frame.pose}})
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) EXPECT_EQ(object.at(key).at(4 * r + c), pose.linear()(r, c));
      EXPECT_NEAR(object.at(key).at(4 * r + 3).get<double>(), 1e-3 * pose.translation()[r], 1e-15);
    }
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) {
      const double unit = (r < 3 ? 1e-3 : 1.0) * (c < 3 ? 1e-3 : 1.0);
      EXPECT_NEAR(object.at("covariance").at(6 * r + c).get<double>(), unit * covariance(r, c), 1e-15);
      EXPECT_NEAR(object.at("map_covariance").at(6 * r + c).get<double>(), 4 * unit * covariance(r, c),
                  1e-15);
    }
    const double sigma = r < 3 ? object.at("sigma_mm").at(r).get<double>()
                               : object.at("sigma_deg").at(r - 3).get<double>() * std::acos(-1.0) / 180.0;
    EXPECT_NEAR(sigma * sigma, covariance(r, r), 1e-9 * covariance(r, r));
  }
  const double pitch = surface->pixel_pitch_mm;
  EXPECT_NEAR(object.at("contact").at("area_mm2").get<double>(), 40 * 20 * pitch * pitch, 1e-9);
  EXPECT_NEAR(object.at("contact").at("center_mm").at(0).get<double>(), (119.5 - 159.5) * pitch, 1e-9);
  EXPECT_NEAR(object.at("contact").at("center_mm").at(1).get<double>(), (59.5 - 119.5) * pitch, 1e-9);
}

TEST(NdjsonLine, SaysNullOfWhatIsNotKnown) {
  TrackedFrame frame;
  frame.status = TrackStatus::background;
  json object = json::parse(ndjson_line({frame}));
  for (const char* key : {"time_unix_s", "trial", "keyframe", "pose", "covariance", "map_pose",
                          "map_covariance", "component", "contact"})
    EXPECT_TRUE(object.at(key).is_null()) << key;
  frame.status = TrackStatus::no_contact;
  const SurfacePtr bare = pressed(0, 0, 0, 0);
  object = json::parse(ndjson_line({.tracked = frame, .surface = bare}));
  EXPECT_EQ(object.at("contact").at("area_mm2"), 0);
  EXPECT_TRUE(object.at("contact").at("center_mm").is_null());
}

// The keyframe of a frame may be so new that it is not in the map yet. Then its pose follows from an older
// keyframe in the map and the odometry between the two.
TEST(MapPlace, FollowsTheMapThroughTheLinksOfNewerKeyframes) {
  std::mt19937 random(2);
  const Pose map_T_old = any_pose(random), step = any_pose(random);
  const auto old_keyframe = keyframe(4, 1), new_keyframe = keyframe(5, 1), newest = keyframe(6, 1);
  const PoseGraphEdge first{4, 5, any_pose(random)}, second{5, 6, any_pose(random)};
  const std::vector<NewKeyframe> newer = {{new_keyframe, first}, {keyframe(7, 2)}, {newest, second}};
  MapSnapshot map;
  const FrameRecord frame = record_of(tracked(2, newest, {}, step));
  EXPECT_FALSE(map.pose_of(frame, newer));
  map.nodes = {node(keyframe(0, 0), 0, Pose::Identity()), node(old_keyframe, 2, map_T_old)};
  const auto place = map.pose_of(frame, newer);
  ASSERT_TRUE(place);
  EXPECT_EQ(place->component, 2);
  EXPECT_TRUE(place->map_T_frame.pose.isApprox(map_T_old * first.from_T_to * second.from_T_to * step, 1e-9));
  EXPECT_FALSE(map.pose_of(frame));

  const Pose corrected = any_pose(random);  // a loop has moved the new keyframe
  map.nodes.push_back(node(new_keyframe, 0, corrected));
  EXPECT_TRUE(
      map.pose_of(frame, newer)->map_T_frame.pose.isApprox(corrected * second.from_T_to * step, 1e-9));

  // The pose of another trial does not depend on that of the trial before.
  const auto other = map.pose_of(record_of(tracked(3, keyframe(7, 2), {}, step)), newer);
  EXPECT_EQ(other->component, 7);
  EXPECT_TRUE(other->map_T_frame.pose.isApprox(step, 1e-9));
  EXPECT_FALSE(map.pose_of(record_of(TrackedFrame()), newer));
}

// The covariance of a frame must be the same whether its keyframe is in the map, or follows from an older one
// by odometry.
TEST(MapPlace, IsKnownAsWellWhetherTheMapHasTheKeyframesOrTheirLinksDo) {
  std::mt19937 random(3);
  MapSnapshot map;
  map.add({keyframe(0, 0)}, {});
  map.scale_factors = Eigen::Vector4d(0.08, 0.01, -0.01, 0.05);
  const std::vector<NewKeyframe> newer = {{keyframe(1, 0), PoseGraphEdge{0, 1, any_pose(random)}},
                                          {keyframe(2, 0), PoseGraphEdge{1, 2, any_pose(random)}}};
  const FrameRecord frame = record_of(tracked(30, newer.back().keyframe, {}, any_pose(random)));
  const MapPlace by_links = *map.pose_of(frame, newer);
  for (const NewKeyframe& added : newer) map.add(added, {});
  const MapPlace in_map = *map.pose_of(frame);
  EXPECT_TRUE(by_links.map_T_frame.pose.isApprox(in_map.map_T_frame.pose, 1e-9));
  EXPECT_TRUE(by_links.map_T_frame.covariance.isApprox(in_map.map_T_frame.covariance, 1e-9));
  EXPECT_GT(in_map.map_T_frame.worst_sigma_mm(), 1);
}

}  // namespace
}  // namespace gelslam
