// Two live sensors that are fixed to each other. Both play the same pictures: they are at the same place.

#include "gelslam/slam/live_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "camera_input.hpp"
#include "gelslam/core/error.hpp"
#include "live_fixture.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::ContainsRegex;
using testing::HasSubstr;

class TwoSensors : public Live {
 protected:
  TwoSensors() {
    rig.run_folder = folder / "run";
    rig.rig = folder / "rig.yaml";
    std::ofstream(rig.rig) << "sigma_mm: 0.001\nsigma_deg: 0.06\n";  // both at one place
  }

  /// Both sources wait until the session is there.
  LiveRig& start_both() {
    Pictures &a = *source, &b = *second_source;
    std::array<LiveRig::Sensor, 2> sensors = {
        {{std::move(source), options}, {std::move(second_source), options}}};
    for (int sensor : {0, 1})
      sensors[static_cast<std::size_t>(sensor)].options.run_folder = run_of_sensor(rig.run_folder, sensor);
    both = std::make_unique<LiveRig>(std::move(sensors), rig);
    a.open();
    b.open();
    return *both;
  }
  /// In a source's thread: until both have tracked this frame.
  void wait_for_both(std::int64_t index) {
    EXPECT_TRUE(comes_true([&] {
      for (const auto& touch : both->touches())
        if (!touch || touch->index < index) return false;
      return true;
    }));
  }

  LiveRigOptions rig;
  std::unique_ptr<Pictures> second_source = std::make_unique<Pictures>(peanut_pictures());
  std::unique_ptr<LiveRig> both;
};

TEST_F(TwoSensors, TheirMapsAreShownAsOneAndSavedAsOne) {
  std::set<int> components;
  std::size_t keyframes = 0;
  const int last = kBackgroundFrames + kScanFrames - 1;
  // Neither sensor goes ahead: the window pairs touches of one time, and a slow machine drops no frame.
  for (int frame = kBackgroundFrames + 1; frame <= last; ++frame) {
    const auto wait = [this, frame] { wait_for_both(frame - 1); };
    if (frame < last) source->before(frame, wait);
    second_source->before(frame, wait);
  }
  source->before(last, [&] {
    EXPECT_TRUE(comes_true([&] {
      const auto map = both->map();
      components.clear();
      for (const MapSnapshot::Node& node : map->nodes) components.insert(node.component);
      keyframes = map->nodes.size();
      return keyframes > 4 && components.size() == 1;
    })) << keyframes
        << " keyframes in " << components.size() << " pieces";
    EXPECT_EQ(both->status().words, "tracking");
  });
  const RunReport summary = start_both().wait();
  EXPECT_EQ(summary.components, 1);
  EXPECT_FALSE(summary.partial);
  ASSERT_TRUE(summary.rig.has_value());
  for (const std::size_t axis : {3, 7, 11}) EXPECT_NEAR(summary.rig->first_T_second_mm[axis], 0, 0.01);
  EXPECT_GT(summary.frames.tracked, 2 * (kScanFrames - 5));
  EXPECT_EQ(both->status().phase, LivePhase::finished);
  EXPECT_EQ(both->status().run_folder, rig.run_folder.string());
  const MeshChanges changes = both->take_mesh_changes();
  EXPECT_TRUE(changes.cleared);
  EXPECT_EQ(changes.blocks.back().mesh.triangles.size(), summary.mesh.triangles);
  EXPECT_TRUE(fs::exists(rig.run_folder / "mesh.ply"));
  for (const int sensor : {0, 1}) EXPECT_TRUE(fs::exists(run_of_sensor(rig.run_folder, sensor) / "mesh.ply"));
}

TEST_F(TwoSensors, TheNextScanIsOfItsOwnFramesOnly) {
  const RunReport first = start_both().wait();
  const std::array<BackgroundFrames, 2> backgrounds = {both->background_frames(0),
                                                       both->background_frames(1)};
  const std::string mesh = read_bytes(rig.run_folder / "mesh.ply");
  rig.run_folder = folder / "run-2";
  std::array<LiveRig::Sensor, 2> sensors;
  for (std::size_t i = 0; i < 2; ++i) {
    std::unique_ptr<Pictures> pictures = touching_pictures();
    pictures->open();
    sensors[i] = {after_background(backgrounds[i], std::move(pictures), 0.04 * kBackgroundFrames), options};
    sensors[i].options.run_folder = run_of_sensor(rig.run_folder, static_cast<int>(i));
  }
  both = std::make_unique<LiveRig>(std::move(sensors), rig);
  const RunReport second = both->wait();
  EXPECT_FALSE(second.partial);
  EXPECT_EQ(second.frames.total, first.frames.total);
  EXPECT_EQ(second.frames.tracked, first.frames.tracked) << "the same pictures";
  EXPECT_TRUE(fs::exists(rig.run_folder / "mesh.ply"));
  EXPECT_TRUE(read_bytes(folder / "run/mesh.ply") == mesh);
}

TEST_F(TwoSensors, OneGoesOnWhenTheOtherIsUnplugged) {
  second_source->before(kBackgroundFrames + 20, [] { throw Error("the camera is gone"); });
  const RunReport summary = start_both().wait();
  EXPECT_GT(summary.frames.tracked, kScanFrames - 5 + 15);
  EXPECT_TRUE(summary.partial);
  EXPECT_EQ(summary.components, 1);
  EXPECT_THAT(both->status().warnings,
              testing::Contains(ContainsRegex("second sensor: .*the camera is gone")));
  EXPECT_EQ(both->status().failure, "");
}

TEST_F(TwoSensors, WhatTheyHaveSavedStaysWhenTheOneMapCannotBe) {
  fs::create_directories(rig.run_folder);
  write_bytes(rig.run_folder / "thesis.txt", "not ours");
  EXPECT_THROW(start_both().wait(), Error);
  EXPECT_THAT(both->status().failure, HasSubstr("run"));
  EXPECT_EQ(both->status().phase, LivePhase::finished);
  for (const int sensor : {0, 1}) EXPECT_TRUE(fs::exists(run_of_sensor(rig.run_folder, sensor) / "mesh.ply"));
  EXPECT_EQ(read_bytes(rig.run_folder / "thesis.txt"), "not ours");
}

}  // namespace
}  // namespace gelslam
