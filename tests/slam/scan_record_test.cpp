#include "gelslam/slam/scan_record.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <limits>
#include <map>
#include <mutex>

#include "../support/temporary_folder.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "run_folder/scan_writer.hpp"
#include "run_folder/session_text.hpp"
#include "small_map.hpp"

namespace {

/// Sizes of files when they were last synced: what a power loss leaves of them.
std::map<std::filesystem::path, std::uintmax_t> synced_sizes;

}  // namespace

/// In front of that of the C library.
extern "C" int fdatasync(int descriptor) {
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  std::error_code code;
  const auto file = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(descriptor), code);
  synced_sizes[file] = std::filesystem::file_size(file, code);
  return static_cast<int>(::syscall(SYS_fdatasync, descriptor));
}

namespace gelslam {
namespace {

using namespace test;
using nlohmann::json;
using testing::HasSubstr;

TEST(Session, HoldsTheWholeRecord) {
  const TemporaryFolder folder;
  ScanRecord before = small_map().measured;
  for (FrameRecord& frame : before.frames)
    if (frame.keyframe >= 0) frame.observable[static_cast<std::size_t>(frame.frame % 6)] = false;
  write_scan(folder / "session", before);
  const ScanRecord after = read_scan(folder / "session", {});
  EXPECT_TRUE(after.warnings.empty());
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
    EXPECT_EQ(after.frames[i].status, before.frames[i].status);
    EXPECT_EQ(after.frames[i].keyframe, before.frames[i].keyframe);
    EXPECT_EQ(after.frames[i].observable, before.frames[i].observable);
    EXPECT_EQ(after.frames[i].keyframe_T_frame.matrix(), before.frames[i].keyframe_T_frame.matrix());
  }
}

TEST(Session, WritingWhatWasReadGivesTheSameBytes) {
  const TemporaryFolder folder;
  write_scan(folder / "a", small_map().measured);
  write_scan(folder / "b", read_scan(folder / "a", {}));
  for (const char* file : {"scan.jsonl", "0.surface", "1.surface", "2.surface"})
    EXPECT_EQ(read_bytes(folder / "a" / file), read_bytes(folder / "b" / file)) << file;
}

TEST(Session, ATrialTakenBackIsGone) {
  const TemporaryFolder folder;
  const ScanRecord before = small_map().measured;
  write_scan(folder / "session", before);
  ScanWriter::append(folder / "session").forget_from_trial(1);
  const ScanRecord after = read_scan(folder / "session", {});
  EXPECT_TRUE(after.keyframes[0]);
  EXPECT_FALSE(after.keyframes[1]);
  for (const PoseGraphEdge& edge : after.edges) EXPECT_TRUE(edge.from != 1 && edge.to != 1);
  for (const FrameRecord& frame : after.frames)
    EXPECT_EQ(frame.status == TrackStatus::undone, frame.trial == 1);
}

/// A kill cuts the record off anywhere: whatever is left is read, and can be written on.
TEST(Session, IsReadWhereverItWasCutOff) {
  const TemporaryFolder folder;
  const ScanRecord whole = small_map().measured;
  write_scan(folder / "session", whole);
  const std::string text = read_bytes(folder / "session" / "scan.jsonl");
  const std::size_t header = text.find('\n') + 1;
  for (std::size_t length = header; length < text.size(); length += 61) {
    write_bytes(folder / "session" / "scan.jsonl", text.substr(0, length));
    const ScanRecord cut = read_scan(folder / "session", {});
    EXPECT_TRUE(cut.warnings.empty()) << cut.warnings.front();
    ScanWriter writer = ScanWriter::append(folder / "session");
    FrameRecord frame;
    frame.frame = 1000;
    writer.add_frame(frame);
    writer.flush();
    const ScanRecord continued = read_scan(folder / "session", {});
    ASSERT_EQ(continued.frames.size(), cut.frames.size() + 1) << length;
    EXPECT_EQ(continued.keyframes.size(), cut.keyframes.size());
  }
}

/// Files that were not synced may be short after a power loss, however long ago they were written.
TEST(Session, APowerLossTakesNoKeyframe) {
  const TemporaryFolder folder;
  const ScanRecord record = small_map().measured;
  const std::filesystem::path file = folder / "scan.jsonl";
  ScanWriter writer = ScanWriter::begin(folder.path());
  for (const auto& keyframe : record.keyframes) {
    for (int i = 0; i < 30; ++i) writer.add_frame(record.frames[static_cast<std::size_t>(20 + i)]);
    writer.add_keyframe(*keyframe, nullptr);
    const std::string text = read_bytes(file);
    write_bytes(file, text.substr(0, synced_sizes[file]));
    EXPECT_TRUE(read_scan(folder.path(), {}).keyframes.at(static_cast<std::size_t>(keyframe->id)));
    write_bytes(file, text);
  }
  writer.add_frame(record.frames.back());
  writer.flush();
  EXPECT_EQ(synced_sizes[file], std::filesystem::file_size(file)) << "at the end all is on the disk";
}

TEST(Session, NamesThatAreNotUtf8AreKeptAsFarAsJsonCan) {
  const TemporaryFolder folder;
  ScanRecord record = small_map().measured;
  record.parts[0].log = "/logs/co\xe9in.mkv";
  write_scan(folder.path(), record);
  const ScanRecord after = read_scan(folder.path(), {});
  EXPECT_TRUE(after.warnings.empty());
  EXPECT_EQ(after.parts.at(0).log, "/logs/co\uFFFDin.mkv");
}

/// A scan that goes on numbers its keyframes from the end of the list, and files and frames bear those
/// numbers.
TEST(Session, TheIdOfADamagedKeyframeIsNotFree) {
  const TemporaryFolder folder;
  write_scan(folder.path(), small_map().measured);
  const std::string surface = read_bytes(folder / "2.surface"), text = read_bytes(folder / "scan.jsonl");
  write_bytes(folder / "2.surface", surface.substr(0, 100));
  const ScanRecord without_surface = read_scan(folder.path(), {});
  ASSERT_EQ(without_surface.keyframes.size(), 3u);
  EXPECT_FALSE(without_surface.keyframes[2]);
  write_bytes(folder / "2.surface", surface);

  std::string bad = text;
  bad[bad.find("\"keyframe\":2") + 20] ^= 1;
  write_bytes(folder / "scan.jsonl", bad);
  const ScanRecord without_line = read_scan(folder.path(), {});
  EXPECT_EQ(without_line.keyframes.size(), 3u) << "frames name it";
  EXPECT_THAT(without_line.warnings, testing::ElementsAre(HasSubstr("1 line is damaged")));
  for (const FrameRecord& frame : without_line.frames) EXPECT_NE(frame.keyframe, 2);
}

TEST(Session, AnyOneLineMayBeDamaged) {
  const TemporaryFolder folder;
  write_scan(folder.path(), small_map().measured);
  const std::string text = read_bytes(folder / "scan.jsonl");
  const std::size_t keyframes = read_scan(folder.path(), {}).keyframes.size();
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1) {
    std::string bad = text;
    bad[begin + 2] ^= 1;
    write_bytes(folder / "scan.jsonl", bad);
    const ScanRecord record = read_scan(folder.path(), {});
    EXPECT_EQ(record.keyframes.size(), keyframes);
    EXPECT_THAT(record.warnings, testing::Contains(HasSubstr("1 line is damaged"))) << begin;
  }
}

/// Checksums that fit do not make sense of a line: it is left out like a damaged one.
TEST(Session, LinesThatCannotBeAreLeftOut) {
  const TemporaryFolder folder;
  write_scan(folder.path(), small_map().measured);
  const std::string text = read_bytes(folder / "scan.jsonl");
  json frame = {{"frames", {{100, 4.0, "tracked", 1, 2, {2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}}}};
  json keyframe = {{"keyframe", 1}, {"frame", 100}, {"trial", 1}, {"link", nullptr}};
  write_bytes(folder / "scan.jsonl",
              text + slam::detail::with_checksum(frame) + slam::detail::with_checksum(keyframe));
  const ScanRecord record = read_scan(folder.path(), {});
  EXPECT_THAT(record.warnings, testing::ElementsAre(HasSubstr("2 lines are damaged")));
  EXPECT_EQ(record.keyframes[1]->frame, 15) << "the first of that id";
  EXPECT_EQ(record.frames.back().frame, 59);
}

/// Programs number on from what a session names, and look its keyframes up.
TEST(Session, ForgedNumbersAreLeftOut) {
  const TemporaryFolder folder;
  constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max();
  const ScanRecord good = small_map().measured;
  const auto read = [&](const auto& forge) {
    ScanRecord forged = good;
    for (auto& keyframe : forged.keyframes) keyframe = std::make_shared<Keyframe>(*keyframe);
    forge(forged);
    write_scan(folder / "session", forged);
    const ScanRecord record = read_scan(folder / "session", {});
    EXPECT_THAT(record.warnings, testing::Contains(HasSubstr("damaged")));
    Mapper mapper{SlamOptions{}};
    mapper.restore(record);
    for (const FrameRecord& frame : record.frames) EXPECT_LT(frame.frame, kHuge / 2);
  };
  read([](ScanRecord& r) { r.frames.back().frame = kHuge; });
  read([](ScanRecord& r) { r.frames.front().frame = -1; });
  read([](ScanRecord& r) { r.frames.back().trial = std::numeric_limits<int>::max(); });
  read([](ScanRecord& r) { r.frames.back().time_s = 1e300; });
  read([](ScanRecord& r) { r.parts.front().first_frame = kHuge; });
  read([](ScanRecord& r) { r.edges.front().from = 7; });  // after `to`
  read([](ScanRecord& r) { r.edges.front().from = -1; });
  read([](ScanRecord& r) { r.edges.front().from_T_to.translation().x() = 1e9; });
  read([](ScanRecord& r) { r.edges.front().information(0, 0) = 1e300; });
  const auto with_keyframe = [&](std::int64_t frame, int trial) {
    read([&](ScanRecord& r) {
      auto keyframe = std::make_shared<Keyframe>(*r.keyframes[0]);
      keyframe->frame = frame;
      keyframe->trial = trial;
      r.keyframes[0] = keyframe;
    });
  };
  with_keyframe(kHuge, 0);
  with_keyframe(0, std::numeric_limits<int>::max());
}

/// Its link leads to another keyframe, and its loops are links.
TEST(Session, ForgedLinksAreLeftOut) {
  const TemporaryFolder folder;
  const ScanRecord good = small_map().measured;
  ScanWriter writer = ScanWriter::begin(folder.path());
  writer.add_keyframe(*good.keyframes[0], nullptr);
  PoseGraphEdge link = good.edges[1];  // of keyframe 2
  writer.add_keyframe(*good.keyframes[1], &link);
  writer.add_loops(0, {link});
  writer.flush();
  const ScanRecord record = read_scan(folder.path(), {});
  EXPECT_THAT(record.warnings, testing::Contains(HasSubstr("2 lines are damaged")));
  EXPECT_TRUE(record.edges.empty());
}

/// All frames have lost their keyframe: their lines were damaged.
TEST(Session, AMapMayHaveKeyframesWithoutFrames) {
  ScanRecord record = small_map().measured;
  for (FrameRecord& frame : record.frames) frame.keyframe = -1;
  Mapper mapper{SlamOptions{}};
  mapper.restore(record);
  EXPECT_GE(mapper.finish(record.frames, false, [] { return false; }).components, 1);
}

}  // namespace
}  // namespace gelslam
