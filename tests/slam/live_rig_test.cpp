// Two live sensors that are fixed to each other. Both play the same pictures: they are at the same place.

#include "gelslam/slam/live_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <utility>

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
  LiveSession& start_both() {
    Pictures &a = *source, &b = *second_source;
    RawFrameSources sources;
    sources.push_back(std::move(source));
    sources.push_back(std::move(second_source));
    begin(std::move(sources));
    a.open();
    b.open();
    return *both;
  }
  void begin(RawFrameSources sources) {
    std::vector<LiveOptions> of_sensor(2, options);
    for (const int sensor : {0, 1})
      of_sensor[static_cast<std::size_t>(sensor)].run_folder = run_of_sensor(rig.run_folder, sensor, 2);
    both = begin_live(std::move(sources), of_sensor, rig);
  }
  /// Triangles of the mesh that the window shows.
  std::size_t drawn() {
    const MeshChanges changes = both->take_mesh_changes();
    if (changes.cleared) triangles.clear();
    for (const MeshBlock& block : changes.blocks) triangles[block.key] = block.mesh.triangles.size();
    std::size_t sum = 0;
    for (const auto& [key, of_block] : triangles) sum += of_block;
    return sum;
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
  std::unique_ptr<LiveSession> both;
  std::map<std::int64_t, std::size_t> triangles;  // by block
};

TEST_F(TwoSensors, TheirMapsAreShownAsOneAndSavedAsOne) {
  std::set<int> components;
  std::size_t keyframes = 0, shown_triangles = 0;
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
    EXPECT_EQ(both->status().components, 1);
    int looks = 0;  // since the mesh has changed
    EXPECT_TRUE(comes_true([&] {
      const std::size_t now = drawn();
      looks = now == std::exchange(shown_triangles, now) && now > 0 ? looks + 1 : 0;
      return looks > 20;
    }));
  });
  const RunReport summary = start_both().wait();
  EXPECT_EQ(summary.components, 1);
  EXPECT_FALSE(summary.partial);
  EXPECT_LT(shown_triangles, 1.5 * static_cast<double>(summary.mesh.triangles)) << "not two surfaces";
  ASSERT_TRUE(summary.rig.has_value());
  for (const std::size_t axis : {3, 7, 11}) EXPECT_NEAR(summary.rig->first_T_second_mm[axis], 0, 0.01);
  EXPECT_GT(summary.frames.tracked, 2 * (kScanFrames - 5));
  EXPECT_EQ(both->status().phase, LivePhase::finished);
  EXPECT_EQ(both->status().run_folder, rig.run_folder.string());
  const MeshChanges changes = both->take_mesh_changes();
  EXPECT_TRUE(changes.cleared);
  EXPECT_EQ(changes.blocks.back().mesh.triangles.size(), summary.mesh.triangles);
  EXPECT_TRUE(fs::exists(rig.run_folder / "mesh.ply"));
  for (const int sensor : {0, 1})
    EXPECT_TRUE(fs::exists(run_of_sensor(rig.run_folder, sensor, 2) / "mesh.ply"));
}

TEST_F(TwoSensors, TheNextScanIsOfItsOwnFramesOnly) {
  const RunReport first = start_both().wait();
  const std::vector<BackgroundFrames> backgrounds = both->background_frames();
  const std::string mesh = read_bytes(rig.run_folder / "mesh.ply");
  rig.run_folder = folder / "run-2";
  RawFrameSources sources;
  for (const BackgroundFrames& background : backgrounds) {
    std::unique_ptr<Pictures> pictures = touching_pictures();
    pictures->open();
    sources.push_back(after_background(background, std::move(pictures), 0.04 * kBackgroundFrames));
  }
  begin(std::move(sources));
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
  for (const int sensor : {0, 1})
    EXPECT_TRUE(fs::exists(run_of_sensor(rig.run_folder, sensor, 2) / "mesh.ply"));
  EXPECT_EQ(read_bytes(rig.run_folder / "thesis.txt"), "not ours");
}

}  // namespace
}  // namespace gelslam
