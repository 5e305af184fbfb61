#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam::test {

/// Returns three keyframes in two components. The first and the last one are in the map.
inline SlamMap small_map() {
  SlamMap map;
  map.anchor_frame = 12;
  map.trials = map.components = 2;
  const Field texture = textured_plane(1);
  for (int id = 0; id < 3; ++id) {
    const Pose pose = motion(1.0 * id, 2, 10 * id, 1.1 * id, -0.7 * id, 0.4);
    View view;
    view.contact_width_px = 40 + 5 * id;
    view.contact_height_px = 30;
    view.contact_center_px = {20.0 * id, -10.0 * id};
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id;
    keyframe->frame = 12 + 3 * id;
    keyframe->trial = id == 1 ? 1 : 0;
    keyframe->surface = SurfacePtr(touch(texture, pose, view));
    map.keyframes.push_back(keyframe);
    map.solution.component_T_node[id] = pose;
    map.solution.component_of_node[id] = id == 1 ? 1 : 0;
    map.in_map.push_back(id != 1);
  }
  map.parts = {{0, "a \"sensor\"", 0xFFFFFFFFu, "/a/log.mkv"}};
  map.searched = {true, true, false};
  Matrix6d information = Matrix6d::Identity();
  information(1, 4) = information(4, 1) = 1.0 / 3.0;
  map.edges = {{0, 1, motion(1, 2, 3, 0.1, 0.2, 0.3), information, EdgeKind::loop, {1.0 / 7, 2, 3}, true},
               {0, 2, motion(3, 2, 1, 0.3, 0.2, 0.1), information, EdgeKind::odometry, {0, 0, 0.1}}};
  for (int i = 0; i < 60; ++i) {
    const bool touches = i >= 10;
    map.frames.push_back({i, i / 25.0, touches ? TrackStatus::tracked : TrackStatus::background,
                          touches ? i / 30 : -1, touches ? i / 20 : -1,
                          touches ? motion(0.1 * i, 0, 0, 0, 0, 0.01) : Pose(Pose::Identity())});
    if (!touches) continue;
    map.frames.back().covariance = information / (1.0 + i);
    map.frames.back().shared_center_mm = {0.1 * i, 1.0 / 3, -0.4};
  }
  return map;
}

/// Returns the message with which a session is refused, and expects that it is one line.
inline std::string refusal(const std::function<void()>& read) {
  const std::string message = message_of(read);
  EXPECT_EQ(message.find('\n'), std::string::npos);
  return message;
}

}  // namespace gelslam::test
