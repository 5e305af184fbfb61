#include "gelslam/slam/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

using namespace test;
using nlohmann::json;
using testing::EndsWith;
using testing::HasSubstr;

/// Three keyframes in two components, the first and the last of them in the map.
SlamMap small_map() {
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
    keyframe->surface = touch(texture, pose, view);
    map.keyframes.push_back(keyframe);
    map.solution.component_T_node[id] = pose;
    map.solution.component_of_node[id] = id == 1 ? 1 : 0;
    map.in_map.push_back(id != 1);
  }
  return map;
}

TEST(Session, ComesBackAsItWasSaved) {
  const TemporaryFolder folder;
  const SlamMap map = small_map();
  save_session(folder / "session", map);
  const Session session = load_session(folder / "session");
  ASSERT_EQ(session.patches.size(), 2u);
  EXPECT_DOUBLE_EQ(session.gradient_scale, 1.0);
  for (const PosedSurface& patch : session.patches) {
    EXPECT_TRUE(patch.id == 0 || patch.id == 2);
    EXPECT_TRUE(patch.map_T_keyframe.matrix().isApprox(map.anchor_T_keyframe(patch.id).matrix(), 1e-14));
    const Surface& before = *map.keyframes[static_cast<std::size_t>(patch.id)]->surface;
    const Surface& after = *patch.surface;
    EXPECT_EQ(after.pixel_pitch_mm, before.pixel_pitch_mm);
    EXPECT_EQ(after.contact_pixels, before.contact_pixels);
    EXPECT_EQ(cv::norm(after.contact, before.contact, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(after.curvature, before.curvature, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(after.height_mm, before.height_mm, cv::NORM_INF, before.contact), 0);
    cv::Mat difference;
    cv::absdiff(after.normals, before.normals, difference);
    difference.setTo(0, before.contact == 0);
    EXPECT_LT(cv::norm(difference.reshape(1), cv::NORM_INF), 1e-6);
    const cv::Vec3f bare = after.normals(0, 0);  // outside the box: untouched gel
    EXPECT_EQ(bare, cv::Vec3f(0, 0, 1));
    EXPECT_EQ(after.height_mm(0, 0), 0.0f);
  }
}

TEST(Session, AMapWithoutKeyframesIsASessionToo) {
  const TemporaryFolder folder;
  save_session(folder / "session", SlamMap{});
  EXPECT_TRUE(load_session(folder / "session").patches.empty());
}

TEST(Session, SavingWhereNothingCanBeWrittenIsAnError) {
  const TemporaryFolder folder;
  write_bytes(folder / "file", "1");
  EXPECT_THAT(message_of<Error>([&] { save_session(folder / "file" / "session", small_map()); }),
              HasSubstr("file"));
}

/// A good session, to be damaged.
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
  const std::string good = (save_session(folder.path(), small_map()), read_bytes(folder / "session.json"));
};

TEST_F(DamagedSession, MissingOrTruncatedJson) {
  for (std::size_t length = 0; length < good.size() - 2; length += 37) {
    write_bytes(folder / "session.json", good.substr(0, length));
    EXPECT_THAT(error(), EndsWith("session.json: damaged, or not a session of gelslam")) << length;
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
