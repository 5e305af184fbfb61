#include "gelslam/slam/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
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
using nlohmann::json;
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

TEST(Session, IsReadWithoutFactorsOfSmallSlopes) {
  const TemporaryFolder folder;
  SlamMap map = small_map();
  for (std::size_t k = 0; k < SlopeCorrection::kTerms; ++k)
    map.slope_correction.factors[k] = 0.001 * static_cast<double>(k);
  save_session(folder.path(), map);
  auto expected = load_map(folder.path()).slope_correction.factors;
  ASSERT_EQ(expected[5], 0.005);
  slam::detail::Json old = slam::detail::Json::parse(read_bytes(folder / "session.json"));
  old.erase("crc32");
  for (const std::size_t axis : {1, 0}) {
    constexpr std::size_t kSmall = SlopeCorrection::kSmallSlopes;
    const std::size_t k = kSmall + axis * SlopeCorrection::kTermsPerAxis;
    old["slope_correction"].erase(k);
    expected[k] = 0.0;
  }
  write_bytes(folder / "session.json", slam::detail::with_checksum(old));
  EXPECT_EQ(load_map(folder.path()).slope_correction.factors, expected);
}

TEST(Session, AMapWithoutKeyframesIsASessionToo) {
  const TemporaryFolder folder;
  save_session(folder / "session", SlamMap{});
  EXPECT_TRUE(load_session(folder / "session").patches.empty());
  EXPECT_TRUE(read_scan(folder / "session", {}).keyframes.empty());
}

TEST(Session, SavingWhereNothingCanBeWrittenIsAnError) {
  const TemporaryFolder folder;
  write_bytes(folder / "file", "1");
  EXPECT_THAT(message_of<Error>([&] { save_session(folder / "file" / "session", small_map()); }),
              HasSubstr("file"));
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

/// Version 1, written as gelslam 0.2 did.
void save_session_v1(const std::filesystem::path& folder, const SlamMap& map) {
  json text = {{"version", 1}, {"anchor_frame", 12}, {"gradient_scale", 1.0}, {"keyframes", json::array()}};
  for (const PosedSurface& patch : posed_surfaces(map)) {
    const SurfacePtr surface = patch.surface.get();
    const cv::Rect box = cv::boundingRect(surface->contact);
    std::vector<double> pose;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) pose.push_back(patch.map_T_keyframe.matrix()(r, c));
    text["width_px"] = surface->contact.cols;
    text["height_px"] = surface->contact.rows;
    text["pixel_pitch_mm"] = surface->pixel_pitch_mm;
    text["keyframes"].push_back({{"id", patch.id},
                                 {"frame", 12},
                                 {"trial", 0},
                                 {"box_px", {box.x, box.y, box.width, box.height}},
                                 {"map_T_keyframe_mm", pose}});
    cv::Mat4f packed(box.size());
    for (int v = 0; v < box.height; ++v)
      for (int u = 0; u < box.width; ++u) {
        const cv::Point p(box.x + u, box.y + v);
        packed(v, u) = {surface->normals(p)[0], surface->normals(p)[1], surface->height_mm(p),
                        surface->contact(p) ? surface->curvature(p) : std::nanf("")};
      }
    cv::imwrite((folder / (std::to_string(patch.id) + ".tiff")).string(), packed);
  }
  write_bytes(folder / "session.json", text.dump(1));
}

TEST(SessionOfVersion1, IsStillRead) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  save_session_v1(folder.path(), map);
  const Session session = load_session(folder.path());
  ASSERT_EQ(session.patches.size(), 2u);
  for (const PosedSurface& patch : session.patches)
    expect_same_surface(*patch.surface.get(),
                        *map.keyframes[static_cast<std::size_t>(patch.id)]->surface.get());
}

/// A good session of version 1, to be damaged.
class DamagedSession : public testing::Test {
 protected:
  std::string error() {
    return message_of<Error>([&] { load_session(folder.path()); });
  }
  /// The error after changing session.json.
  template <class Change>
  std::string error_with(Change&& change) {
    json edited = json::parse(good);
    change(edited);
    write_bytes(folder / "session.json", edited.dump());
    const std::string message = error();
    write_bytes(folder / "session.json", good);
    EXPECT_THAT(message, HasSubstr("session.json"));
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0);
    return message;
  }

  TemporaryFolder folder;
  const std::string good = (save_session_v1(folder.path(), small_map()), read_bytes(folder / "session.json"));
};

TEST_F(DamagedSession, MissingOrTruncatedJson) {
  for (std::size_t length = 0; length < good.size() - 2; length += 37) {
    write_bytes(folder / "session.json", good.substr(0, length));
    EXPECT_THAT(error(), HasSubstr("session.json: damaged")) << length;
  }
  std::filesystem::remove(folder / "session.json");
  EXPECT_THAT(error(), HasSubstr("session.json"));
}

TEST_F(DamagedSession, TheOldNameOfTheGradientScaleIsStillRead) {
  json old = json::parse(good);
  old["slope_gain"] = 1.25;
  old.erase("gradient_scale");
  write_bytes(folder / "session.json", old.dump());
  EXPECT_DOUBLE_EQ(load_session(folder.path()).gradient_scale, 1.25);
}

TEST_F(DamagedSession, NumbersThatContradictThemselves) {
  EXPECT_THAT(error_with([](json& j) { j["version"] = 99; }), HasSubstr("version"));
  error_with([](json& j) { j["width_px"] = 0; });
  error_with([](json& j) { j["width_px"] = 2000000000; });
  error_with([](json& j) { j["height_px"] = "240"; });
  error_with([](json& j) { j["pixel_pitch_mm"] = 0; });
  error_with([](json& j) { j["pixel_pitch_mm"] = -0.06; });
  error_with([](json& j) { j["gradient_scale"] = 0; });
  error_with([](json& j) { j["gradient_scale"] = nullptr; });
  error_with([](json& j) { j["keyframes"] = 7; });
  error_with([](json& j) { j["keyframes"][0].erase("id"); });
  error_with([](json& j) { j["keyframes"][0]["id"] = "../../etc/passwd"; });
  error_with([](json& j) { j["keyframes"][1]["id"] = 0; });  // twice
  constexpr int kLargest = std::numeric_limits<int>::max();
  for (const std::vector<int>& box : {std::vector<int>{-1, 0, 10, 10},
                                      {0, 0, 400, 10},
                                      {310, 0, 20, 10},
                                      {0, 0, 10, -10},
                                      {kLargest, 0, kLargest, 1},
                                      {1, 1, kLargest, kLargest},
                                      {0, 0, 10}})
    error_with([&](json& j) { j["keyframes"][0]["box_px"] = box; });
}

TEST_F(DamagedSession, PosesThatAreNoRigidMotions) {
  const auto with_entry = [&](std::size_t entry, double value) {
    return error_with([&](json& j) { j["keyframes"][0]["map_T_keyframe_mm"][entry] = value; });
  };
  EXPECT_THAT(with_entry(0, 1.5), HasSubstr("rigid"));
  EXPECT_THAT(with_entry(3, 1e308 * 10), HasSubstr("session.json"));  // written as null
  error_with([&](json& j) { j["keyframes"][0]["map_T_keyframe_mm"].erase(0); });
  error_with([&](json& j) {  // sheared, although its determinant is 1
    j["keyframes"][0]["map_T_keyframe_mm"] = {1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  });
}

TEST_F(DamagedSession, PicturesThatAreNotThosePromised) {
  const std::filesystem::path picture = folder / "2.tiff";
  const std::string bytes = read_bytes(picture);
  const cv::Mat promised = cv::imread(picture.string(), cv::IMREAD_UNCHANGED);
  const auto expect_refused = [&](const char* how) {
    EXPECT_THAT(error(), HasSubstr("2.tiff")) << how;
    write_bytes(picture, bytes);
  };
  std::filesystem::remove(picture);
  expect_refused("missing");
  for (const std::size_t length : {std::size_t{0}, std::size_t{8}, bytes.size() / 2}) {
    write_bytes(picture, bytes.substr(0, length));
    expect_refused("truncated");
  }
  write_bytes(picture, "II*\0\x08\0\0\0 and then nothing that makes sense");
  expect_refused("garbage");
  cv::imwrite(picture.string(), promised(cv::Rect(0, 0, promised.cols - 1, promised.rows)));
  expect_refused("too small");
  cv::imwrite(picture.string(), cv::Mat1b(promised.size(), 7));
  expect_refused("gray");
  cv::Mat4f infinite = promised.clone();
  infinite(10, 10)[2] = std::numeric_limits<float>::infinity();
  cv::imwrite(picture.string(), infinite);
  expect_refused("an infinite height");
  cv::Mat4f steep = promised.clone();
  steep(10, 10)[0] = 1.5f;
  cv::imwrite(picture.string(), steep);
  expect_refused("a normal longer than 1");
  EXPECT_EQ(load_session(folder.path()).patches.size(), 2u);
}

}  // namespace
}  // namespace gelslam
