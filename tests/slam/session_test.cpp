#include "gelslam/slam/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "../support/file_size_limit.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "run_folder/scan_writer.hpp"
#include "run_folder/session_text.hpp"
#include "small_map.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;

void expect_same_surface(const Surface& after, const Surface& before) {
  EXPECT_EQ(after.pixel_pitch_mm, before.pixel_pitch_mm);
  EXPECT_EQ(after.contact_pixels, before.contact_pixels);
  EXPECT_EQ(cv::norm(after.contact, before.contact, cv::NORM_INF), 0);
  EXPECT_LE(cv::norm(after.curvature, before.curvature, cv::NORM_INF), PackedSurface::kCurvatureStep);
  EXPECT_LE(cv::norm(after.height_mm, before.height_mm, cv::NORM_INF, before.contact),
            PackedSurface::kHeightStepMm);
}

TEST(Session, ComesBackAsItWasSaved) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  save_session(folder / "session", map);
  const Session session = load_session(folder / "session");
  ASSERT_EQ(session.patches.size(), 2u);
  EXPECT_TRUE(session.warnings.empty());
  EXPECT_DOUBLE_EQ(session.gradient_scale, 1.0);
  for (const PosedSurface& patch : session.patches) {
    EXPECT_TRUE(patch.id == 0 || patch.id == 2);
    EXPECT_TRUE(patch.map_T_keyframe.matrix().isApprox(map.anchor_T_keyframe(patch.id).matrix(), 1e-14));
    expect_same_surface(*patch.surface.get(),
                        *map.keyframes[static_cast<std::size_t>(patch.id)]->surface.get());
  }
}

TEST(Session, ADamagedKeyframeIsLeftOutAndTheRestIsUsed) {
  const TemporaryFolder folder;
  save_session(folder.path(), small_map());
  std::string bytes = read_bytes(folder / "2.surface");
  bytes[bytes.size() / 2] ^= 1;
  write_bytes(folder / "2.surface", bytes);
  const Session session = load_session(folder.path());
  ASSERT_EQ(session.patches.size(), 1u);
  ASSERT_EQ(session.warnings.size(), 1u);
  EXPECT_THAT(session.warnings[0], HasSubstr("1 keyframe of"));
  EXPECT_THAT(session.warnings[0], HasSubstr("2.surface: damaged: its checksum does not match"));
  std::filesystem::remove(folder / "2.surface");
  const ScanRecord record = read_scan(folder.path(), {});
  EXPECT_TRUE(record.keyframes[0] && record.keyframes[1]);
  ASSERT_EQ(record.warnings.size(), 1u);
  EXPECT_THAT(record.warnings[0], HasSubstr("2.surface: cannot be read"));
  for (const PoseGraphEdge& edge : record.edges) EXPECT_NE(edge.to, 2);
  for (const FrameRecord& frame : record.frames) EXPECT_NE(frame.keyframe, 2);
}

TEST(Session, ANewerVersionIsRefusedInClearWords) {
  const TemporaryFolder folder;
  save_session(folder.path(), small_map());
  write_bytes(folder / "session.json", R"({"version":3,"something":"else"})");
  EXPECT_THAT(message_of<Error>([&] { load_session(folder.path()); }),
              HasSubstr("session.json: written by a newer version of the program (session version 3"));
  write_bytes(folder / "scan.jsonl", slam::detail::with_checksum({{"version", 3}}));
  EXPECT_THAT(message_of<Error>([&] { read_scan(folder.path(), {}); }),
              HasSubstr("scan.jsonl: written by a newer version"));
}

TEST(Session, AChangedNumberIsNoticed) {
  const TemporaryFolder folder;
  save_session(folder.path(), small_map());
  std::string text = read_bytes(folder / "session.json");
  text.replace(text.find("\"anchor_frame\":12"), 17, "\"anchor_frame\":13");
  write_bytes(folder / "session.json", text);
  EXPECT_THAT(message_of<Error>([&] { load_session(folder.path()); }), HasSubstr("checksum does not match"));
  std::filesystem::remove(folder / "session.json");
  EXPECT_THAT(message_of<Error>([&] { load_session(folder.path()); }), HasSubstr("was not finished"));
}

/// Any byte of any file: an Error or a warning, and never anything else.
TEST(Session, SurvivesChangedBytes) {
  const TemporaryFolder folder;
  save_session(folder.path(), small_map());
  std::mt19937 random(7);
  for (const char* name : {"session.json", "scan.jsonl", "0.surface"}) {
    const std::string good = read_bytes(folder / name);
    for (int round = 0; round < 150; ++round) {
      std::string bad = good;
      for (auto changes = 1 + random() % 3; changes > 0; --changes)
        bad[random() % bad.size()] = static_cast<char>(random());
      if (round % 5 == 0) bad.resize(random() % bad.size());
      write_bytes(folder / name, bad);
      bool noticed = bad == good;
      try {
        noticed |= !load_session(folder.path()).warnings.empty();
        noticed |= !read_scan(folder.path(), {}).warnings.empty();
      } catch (const Error& error) {
        noticed = true;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
      EXPECT_TRUE(noticed || round % 5 == 0) << name << ", round " << round;
    }
    write_bytes(folder / name, good);
  }
}

TEST(Session, AMapWithoutKeyframesIsASessionToo) {
  const TemporaryFolder folder;
  save_session(folder / "session", SlamMap{});
  EXPECT_TRUE(load_session(folder / "session").patches.empty());
  EXPECT_TRUE(read_scan(folder / "session", {}).keyframes.empty());
}

TEST(Session, AFullDiskIsAnErrorAndWhatWasWrittenIsRead) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  std::string message;
  {
    const FileSizeLimit limit(2500);
    message = message_of<Error>([&] { save_session(folder / "session", map); });
  }
  EXPECT_THAT(message, HasSubstr("cannot be written"));
  EXPECT_NO_THROW(read_scan(folder / "session", {}));
}

/// A session whose numbers are changed, with a checksum that is right.
class ForgedSession : public testing::Test {
 protected:
  template <class Change>
  std::string error_with(Change&& change) {
    slam::detail::Json edited = slam::detail::Json::parse(good);
    edited.erase("crc32");
    change(edited);
    write_bytes(folder / "session.json", slam::detail::with_checksum(edited));
    const std::string message = message_of<Error>([&] { load_session(folder.path()); });
    EXPECT_THAT(message, HasSubstr("session.json"));
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0);
    return message;
  }

  TemporaryFolder folder;
  const std::string good = (save_session(folder.path(), small_map()), read_bytes(folder / "session.json"));
};

TEST_F(ForgedSession, NumbersThatContradictThemselves) {
  using slam::detail::Json;
  EXPECT_THAT(error_with([](Json& j) { j["version"] = 1; }), HasSubstr("version"));
  error_with([](Json& j) { j["scan_bytes"] = "many"; });
  error_with([](Json& j) { j["gradient_scale"] = 0; });
  error_with([](Json& j) { j["gradient_scale"] = nullptr; });
  error_with([](Json& j) { j["keyframes"] = 7; });
  error_with([](Json& j) { j["keyframes"][0].erase("id"); });
  error_with([](Json& j) { j["keyframes"][0]["id"] = "../../etc/passwd"; });
  EXPECT_THAT(error_with([](Json& j) { j["keyframes"][2]["id"] = 0; }), HasSubstr("do not ascend"));
}

TEST_F(ForgedSession, PosesThatAreNoRigidMotions) {
  using slam::detail::Json;
  const auto with_entry = [&](std::size_t entry, double value) {
    return error_with([&](Json& j) { j["keyframes"][0]["map_T_keyframe_mm"][entry] = value; });
  };
  EXPECT_THAT(with_entry(0, 1.5), HasSubstr("rigid"));
  with_entry(3, 1e308 * 10);  // written as null
  EXPECT_THAT(error_with([&](Json& j) { j["keyframes"][0]["map_T_keyframe_mm"].erase(0); }),
              HasSubstr("12 numbers"));
  EXPECT_THAT(error_with([&](Json& j) {  // sheared, although its determinant is 1
                j["keyframes"][0]["map_T_keyframe_mm"] = {1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
              }),
              HasSubstr("rigid"));
}

}  // namespace
}  // namespace gelslam
