#include "gelslam/slam/store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <map>
#include <mutex>
#include <random>

#include "../support/database.hpp"
#include "../support/file_size_limit.hpp"
#include "../support/killed_process.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "small_map.hpp"

namespace {

/// The sizes of files when they were last synced. After a power loss, only that much of a file may be left.
std::map<std::filesystem::path, std::uintmax_t> synced_sizes;

}  // namespace

/// Replaces the function of the C library in order to record the sizes.
extern "C" int fdatasync(int descriptor) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  std::error_code code;
  const auto file = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor), code);
  synced_sizes[file] = std::filesystem::file_size(file, code);
  return static_cast<int>(::syscall(SYS_fdatasync, descriptor));
}

namespace gelslam::test {
namespace {

/// Returns the small map with a given record of its measurements.
SlamMap map_of(const ScanRecord& record) {
  SlamMap map = small_map();
  static_cast<ScanRecord&>(map) = record;
  return map;
}

NewKeyframe unlinked(const std::shared_ptr<const Keyframe>& keyframe, int id) {
  auto added = std::make_shared<Keyframe>(*keyframe);
  added->id = id;
  added->frame = id;
  return {std::move(added), {}};
}

FrameRecord frame_of(int number) {
  return {.frame = number, .time_s = 0.04 * number, .status = TrackStatus::tracked, .trial = 0};
}

TEST(Store, HoldsTheWholeRecord) {
  const TemporaryFolder folder;
  ScanRecord before = small_map();
  for (FrameRecord& frame : before.frames)
    if (frame.keyframe >= 0) frame.observable[static_cast<std::size_t>(frame.frame % 6)] = false;
  before.frames.back().unix_us = 1764268461123457;
  write_store(folder.path(), map_of(before));
  const ScanRecord after = read_scan(folder.path(), {});
  ASSERT_EQ(after.parts.size(), 1u);
  EXPECT_EQ(after.parts[0].sensor, "a \"sensor\"");
  EXPECT_EQ(after.parts[0].model_crc32, 0xFFFFFFFFu);
  ASSERT_EQ(after.keyframes.size(), 3u);
  EXPECT_EQ(after.keyframes[1]->trial, 1);
  EXPECT_EQ(after.keyframes[1]->frame, 15);
  EXPECT_EQ(after.searched, before.searched);
  ASSERT_EQ(after.edges.size(), before.edges.size());
  for (std::size_t i = 0; i < after.edges.size(); ++i) {
    EXPECT_EQ(after.edges[i].from, before.edges[i].from);
    EXPECT_EQ(after.edges[i].kind, before.edges[i].kind);
    EXPECT_EQ(after.edges[i].tentative, before.edges[i].tentative);
    EXPECT_EQ(after.edges[i].from_T_to.matrix(), before.edges[i].from_T_to.matrix());  // to the last bit
    EXPECT_EQ(after.edges[i].information, before.edges[i].information);
    EXPECT_EQ(after.edges[i].shared_center_mm, before.edges[i].shared_center_mm);
  }
  ASSERT_EQ(after.frames.size(), before.frames.size());
  for (std::size_t i = 0; i < after.frames.size(); ++i) {
    EXPECT_EQ(after.frames[i].frame, before.frames[i].frame);
    EXPECT_EQ(after.frames[i].time_s, before.frames[i].time_s);
    EXPECT_EQ(after.frames[i].unix_us, before.frames[i].unix_us);
    EXPECT_EQ(after.frames[i].status, before.frames[i].status);
    EXPECT_EQ(after.frames[i].trial, before.frames[i].trial);
    EXPECT_EQ(after.frames[i].keyframe, before.frames[i].keyframe);
    EXPECT_EQ(after.frames[i].observable, before.frames[i].observable);
    EXPECT_EQ(after.frames[i].keyframe_T_frame.matrix(), before.frames[i].keyframe_T_frame.matrix());
    EXPECT_EQ(after.frames[i].covariance, before.frames[i].covariance);
    EXPECT_EQ(after.frames[i].shared_center_mm, before.frames[i].shared_center_mm);
  }
}

TEST(Store, KnowsPatchesByThatNothingRefersToThem) {
  const TemporaryFolder folder;
  SlamMap map = small_map();
  for (FrameRecord& frame : map.frames)
    if (frame.keyframe > 0) frame.keyframe = 0;
  write_store(folder.path(), map);  // 1 was searched, 2 was not
  const ScanRecord after = read_scan(folder.path(), {});
  for (std::size_t id = 0; id < 3; ++id) EXPECT_EQ(after.keyframes[id]->is_patch, id == 2) << id;
}

TEST(Store, WritingWhatWasReadGivesTheSameBytes) {
  const TemporaryFolder folder;
  for (const char* name : {"a", "b"}) fs::create_directory(folder / name);
  write_store(folder / "a", small_map());
  write_store(folder / "b", map_of(read_scan(folder / "a", {})));
  EXPECT_TRUE(read_bytes(folder / "a/session.db") == read_bytes(folder / "b/session.db"));
}

TEST(Store, HoldsTheMap) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  write_store(folder.path(), map);
  const MapSnapshot session = load_saved_map(folder.path());
  ASSERT_EQ(session.nodes.size(), 2u);
  EXPECT_EQ(session.warning, "");
  EXPECT_DOUBLE_EQ(session.gradient_scale.mean(), 1.0);
  for (const PosedSurface& patch : posed_surfaces(session)) {
    EXPECT_TRUE(patch.id == 0 || patch.id == 2);
    EXPECT_EQ(patch.map_T_keyframe.matrix(), map.anchor_T_keyframe(patch.id).matrix());
    const SurfacePtr after = patch.surface.get(),
                     before = map.keyframes[static_cast<std::size_t>(patch.id)]->surface.get();
    EXPECT_EQ(cv::norm(after->contact, before->contact, cv::NORM_INF), 0);
    EXPECT_LE(cv::norm(after->height_mm, before->height_mm, cv::NORM_INF, before->contact),
              PackedSurface::kHeightStepMm);
  }
}

/// An older version of the program removed the trial. Its number must not be used again, because files and
/// frames may have it.
TEST(Store, ATrialTakenBackIsGone) {
  const TemporaryFolder folder;
  write_store(folder.path(), small_map());
  sql(folder / "session.db",
      "UPDATE keyframes SET surface=NULL WHERE trial>=1;"
      "UPDATE frames SET status='undone', keyframe=NULL WHERE trial>=1");
  const ScanRecord after = read_scan(folder.path(), {});
  EXPECT_TRUE(after.keyframes[0]);
  EXPECT_FALSE(after.keyframes[1]);
  for (const PoseGraphEdge& edge : after.edges) EXPECT_TRUE(edge.from != 1 && edge.to != 1);
  for (const FrameRecord& frame : after.frames)
    EXPECT_EQ(frame.status == TrackStatus::lost, frame.trial == 1);
  EXPECT_THAT(load_saved_map(folder.path()).warning, HasSubstr("the scan went on after its map was saved"));
  EXPECT_EQ(after.keyframes.size(), 3u);
}

TEST(Store, AMapIsThatOfItsFrames) {
  const TemporaryFolder folder;
  begin_store(folder.path(), small_map().parts.front());
  EXPECT_FALSE(find_saved_map(folder.path()));
  EXPECT_THAT(refusal([&] { load_saved_map(folder.path()); }), HasSubstr("the scan was not finished"));
  Store store(folder.path());
  store.set_map(SlamMap{});
  EXPECT_EQ(load_saved_map(folder.path()).warning, "");
  store.add(frame_of(7));
  store.flush();
  EXPECT_THAT(load_saved_map(folder.path()).warning, HasSubstr("went on"));
}

/// Reading a session must create no file, neither while it is written nor after the program was killed.
TEST(Store, IsReadWhileItGrowsWithoutATrace) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  begin_store(folder.path(), map.parts.front());
  {
    Store store(folder.path());
    for (int id = 0; id < 3; ++id) {
      store.add(frame_of(id));
      store.add(unlinked(map.keyframes[0], id));
      const auto names = folder.names();
      EXPECT_EQ(read_scan(folder.path(), {}).keyframes.size(), static_cast<std::size_t>(id) + 1);
      EXPECT_EQ(folder.names(), names);
    }
  }
  EXPECT_THAT(folder.names(), testing::ElementsAre("session.db")) << "one file when it is closed";
  read_scan(folder.path(), {});
  EXPECT_THAT(folder.names(), testing::ElementsAre("session.db"));
}

/// The program is killed at a random time. At most one keyframe and the frames of one second may be lost.
TEST(Store, AKillTakesNoMoreThanOneKeyframe) {
  std::mt19937 random(std::random_device{}());
  const auto keyframe = small_map().keyframes[0];
  keyframe->surface.packed();
  for (int round = 0; round < 8; ++round) {
    const TemporaryFolder folder;
    begin_store(folder.path(), small_map().parts.front());
    KilledProcess scan([&](const auto& tell) {
      Store store(folder.path());
      for (int id = 0;; ++id) {
        store.add(frame_of(id));
        store.add(unlinked(keyframe, id));
        store.add_loops(id, {});
        tell();
      }
    });
    ::usleep(20'000 + static_cast<unsigned>(random() % 60'000));
    const auto known = static_cast<std::size_t>(scan.kill());
    const ScanRecord left = read_scan(folder.path(), {});
    EXPECT_GE(left.keyframes.size(), known);
    EXPECT_LE(left.keyframes.size(), known + 1);
    EXPECT_EQ(left.frames.size(), left.keyframes.size());
    const int next = static_cast<int>(left.keyframes.size());
    Store store(folder.path());
    store.add(frame_of(next));
    store.add(unlinked(keyframe, next));
    EXPECT_EQ(read_scan(folder.path(), {}).keyframes.size(), left.keyframes.size() + 1) << "it goes on";
  }
}

/// After a power loss, files that were not synced may be too short, no matter how long ago they were written.
TEST(Store, APowerLossTakesNoKeyframe) {
  const TemporaryFolder folder, after;
  const auto keyframe = small_map().keyframes[0];
  begin_store(folder.path(), small_map().parts.front());
  Store store(folder.path());
  for (int id = 0; id < 3; ++id) {
    for (int i = 0; i < 30; ++i) store.add(frame_of(100 * id + i));
    store.add(frame_of(100 * id + 30));
    store.add({std::make_shared<Keyframe>(Keyframe{id, 100 * id, 0, keyframe->surface, {}}), {}});
    for (const char* name : {"session.db", "session.db-wal"})
      write_bytes(after / name, read_bytes(folder / name).substr(0, synced_sizes[folder / name]));
    const ScanRecord left = read_scan(after.path(), {});
    EXPECT_EQ(left.keyframes.size(), static_cast<std::size_t>(id) + 1);
    EXPECT_EQ(left.frames.size(), 31u * (static_cast<unsigned>(id) + 1));
    for (const std::string& name : after.names()) fs::remove(after / name);
  }
}

TEST(Store, AFullDiskIsAnErrorAndWhatWasWrittenIsRead) {
  const TemporaryFolder folder;
  const auto keyframe = small_map().keyframes[0];
  begin_store(folder.path(), small_map().parts.front());
  std::string message;
  int added = 0;
  {
    Store store(folder.path());
    const FileSizeLimit limit(300'000);
    message = refusal([&] {
      for (; added < 1000; ++added) {
        store.add(frame_of(added));
        store.add(unlinked(keyframe, added));
      }
    });
  }
  EXPECT_THAT(message, HasSubstr("session.db: cannot be written: "));
  EXPECT_GT(added, 1);
  EXPECT_EQ(read_scan(folder.path(), {}).keyframes.size(), static_cast<std::size_t>(added));
  for (const rlim_t bytes : {2500, 4096, 100'000}) {
    const TemporaryFolder whole;
    const FileSizeLimit limit(bytes);
    EXPECT_THAT(refusal([&] { write_store(whole.path(), small_map()); }),
                testing::AllOf(HasSubstr("cannot be written"), testing::Not(HasSubstr("Success"))))
        << bytes;
  }
}

}  // namespace
}  // namespace gelslam::test
