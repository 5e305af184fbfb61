// Tests the readers of the lines of a scan: slow readers, late readers, and standard output; and readers of
// its mesh.

#include "gelslam/slam/line_feed.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "../support/temporary_folder.hpp"
#include "gelslam/slam/mesh_feed.hpp"

namespace gelslam {
namespace {

using namespace std::chrono_literals;

FrameReport frame(int number) {
  FrameReport frame{.in_map = MapPlace{}, .localization = Localization{}};
  frame.tracked.frame = number;
  frame.tracked.time_s = number;
  return frame;
}

/// Returns the numbers of the frames in lines of either format, then "dropped N" and "end".
std::string frames_in(const std::string& text) {
  std::string numbers;
  for (const std::string& line : test::lines_of(text)) {
    const bool is_json = line.starts_with("{");
    const auto json = is_json ? nlohmann::json::parse(line) : nlohmann::json();
    if (!is_json)
      numbers += line.substr(0, line.find(' ')) + " ";
    else if (json.at("type") == "dropped")
      numbers += "dropped " + json.at("lines").dump() + " ";
    else
      numbers += json.at("frame").dump() + " ";
  }
  return numbers;
}

/// Reads until no line has come for a while, and returns the text, followed by "end" if the feed has ended.
std::string all_of(LineFeed::Reader& reader) {
  std::string text;
  for (;;) {
    const auto lines = reader.next(std::chrono::steady_clock::now() + 20ms);
    if (!lines) return text + "end";
    if (lines->empty()) return text;
    text += *lines;
  }
}

TEST(LineFeed, GivesEachReaderItsFormatFromWhereItCame) {
  LineFeed feed;
  feed.write(frame(0));
  const auto early = feed.open({}), tum = feed.open({.tum = true});
  feed.write(frame(1));
  const auto late = feed.open({});
  feed.write(frame(2));
  EXPECT_EQ(frames_in(all_of(*early)), "1 2 ");
  EXPECT_EQ(frames_in(all_of(*tum)), "1 2 ");
  EXPECT_EQ(frames_in(all_of(*late)), "2 ");
  feed.write(frame(3));
  feed.close();
  EXPECT_EQ(frames_in(all_of(*late)), "3 end ") << "what is queued still comes";
  EXPECT_EQ(all_of(*feed.open({})), "end");
}

TEST(LineFeed, ASlowReaderLosesTheOldestAndIsTold) {
  LineFeed feed;
  const auto slow = feed.open({});
  for (int k = 0; k < 1000; ++k) feed.write(frame(k));
  EXPECT_EQ(frames_in(*slow->next({})), "dropped 744 744 ");
  EXPECT_EQ(frames_in(*slow->next({})), "745 ");
  for (int k = 1000; k < 1003; ++k) feed.write(frame(k));
  EXPECT_EQ(frames_in(*slow->next({})), "dropped 1 747 ");
}

TEST(LineFeed, EncodesAPictureOnceForAllReaders) {
  LineFeed feed;
  const auto first = feed.open({.images = true}), second = feed.open({.images = true});
  FrameReport seen = frame(0);
  seen.image = cv::Mat3b(24, 32, cv::Vec3b(10, 200, 30));
  feed.write(seen);
  const std::string line = all_of(*first);
  seen.image.setTo(cv::Scalar::all(255));
  EXPECT_GT(line.size(), 300u);
  EXPECT_EQ(all_of(*second), line);
}

std::vector<nlohmann::json> parsed(const std::string& text) {
  std::vector<nlohmann::json> lines;
  for (const std::string& line : test::lines_of(text)) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

std::shared_ptr<MapSnapshot> map_of(const std::vector<int>& ids) {
  auto surface = std::make_shared<Surface>();
  surface->contact = cv::Mat1b(24, 32, static_cast<unsigned char>(255));
  surface->height_mm = cv::Mat1f(24, 32, 0.0F);
  surface->contact_pixels = 24 * 32;
  auto map = std::make_shared<MapSnapshot>();
  for (const int id : ids) {
    MapSnapshot::Node node;
    node.keyframe = id;
    node.surface = StoredSurface(SurfacePtr(surface));
    map->nodes.push_back(node);
  }
  return map;
}

TEST(LineFeed, EachKeyframeComesOnceBeforeTheMapThatNamesIt) {
  LineFeed feed;
  feed.set_map(map_of({0, 1}));
  const auto reader = feed.open({.surface = true}), without = feed.open({});
  auto lines = parsed(all_of(*reader));
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["keyframe"], 0);
  EXPECT_EQ(lines[1]["points"].size(), 24u * 32u);
  EXPECT_EQ(lines[2]["type"], "map");
  feed.set_map(map_of({0, 2}));  // 1 is missing
  lines = parsed(all_of(*reader));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["keyframe"], 2);
  feed.start_scan();  // it counts anew
  feed.set_map(map_of({0}));
  lines = parsed(all_of(*reader));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["scan"], 1);
  EXPECT_EQ(lines[1]["keyframes"].size(), 1u);
  EXPECT_EQ(all_of(*without), "");
}

TEST(LineFeed, AMapNamesWhatIsNewOrHasMovedHoweverLargeItIs) {
  LineFeed feed;
  const auto reader = feed.open({.surface = true});
  const auto named = [&](const std::shared_ptr<MapSnapshot>& map) {
    feed.set_map(map);
    const auto lines = parsed(all_of(*reader));
    std::vector<int> ids;
    for (const auto& keyframe : lines.back()["keyframes"]) ids.push_back(keyframe["keyframe"]);
    return ids;
  };
  EXPECT_EQ(named(map_of({0, 1, 2})), (std::vector{0, 1, 2}));
  EXPECT_EQ(named(map_of({0, 1, 2, 3})), (std::vector{3}));
  const auto moved = map_of({0, 1, 2, 3, 4});
  moved->nodes[1].component_T_keyframe.translation().x() = 1e-9;
  moved->nodes[2].component = 2;
  EXPECT_EQ(named(moved), (std::vector{1, 2, 4}));
  EXPECT_EQ(named(map_of({0, 1, 2, 3, 4})), (std::vector{1, 2})) << "back again";
}

/// Redirects standard output to another descriptor for the lifetime of the object.
struct RedirectedOutput {
  explicit RedirectedOutput(int fd) : saved(::dup(STDOUT_FILENO)) { ::dup2(fd, STDOUT_FILENO); }
  ~RedirectedOutput() {
    ::dup2(saved, STDOUT_FILENO);
    ::close(saved);
  }
  const int saved;
};

TEST(LineOutput, AFullDiskIsAFailureAndAReaderThatLeftIsNot) {
  std::fflush(stdout);
  const int full = ::open("/dev/full", O_WRONLY);
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  ::close(pipe_ends[0]);
  for (const auto& [fd, good] : {std::pair(full, false), std::pair(pipe_ends[1], true)}) {
    const RedirectedOutput redirected(fd);
    LineFeed feed;
    LineOutput output(feed, {});
    feed.write(frame(0));
    EXPECT_EQ(output.finish(), good);
  }
  ::close(full);
  ::close(pipe_ends[1]);
}

TEST(LineOutput, EndsThoughItsReaderDoesNotRead) {
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const RedirectedOutput redirected(pipe_ends[1]);
  LineFeed feed;
  LineOutput output(feed, {});
  // More than a pipe holds.
  feed.write({.localization = Localization{.reason = std::string(1 << 20, 'x')}});
  EXPECT_TRUE(output.finish());
  ::close(pipe_ends[0]);
  ::close(pipe_ends[1]);
}

MeshBlock block(std::int64_t key, int triangles) {
  MeshBlock block;
  block.key = key;
  for (int k = 0; k < triangles; ++k) {
    for (int corner = 0; corner < 3; ++corner)
      block.mesh.vertices_mm.push_back(Eigen::Vector3f::Constant(static_cast<float>(k + corner)));
    block.mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  return block;
}

std::vector<std::int64_t> keys(const MeshFeed::Changes& changes) {
  std::vector<std::int64_t> keys;
  for (const auto& block : changes.blocks) keys.push_back(block->key);
  return keys;
}

TEST(MeshFeed, TellsEachReaderWhatItDoesNotHave) {
  MeshFeed feed;
  feed.add(false, {block(7, 1), block(3, 2)});
  const auto first = feed.since(0, SIZE_MAX);
  EXPECT_EQ(keys(first), (std::vector<std::int64_t>{7, 3}));
  EXPECT_TRUE(feed.since(first.version, SIZE_MAX).blocks.empty());
  feed.add(false, {block(7, 3)});
  EXPECT_EQ(keys(feed.since(first.version, SIZE_MAX)), (std::vector<std::int64_t>{7}));
  EXPECT_EQ(keys(feed.since(0, SIZE_MAX)), (std::vector<std::int64_t>{3, 7})) << "each once, as it is now";
  EXPECT_EQ(feed.whole().triangles.size(), 5u);
  EXPECT_EQ(feed.whole().triangles.back(), Eigen::Vector3i(12, 13, 14));
}

TEST(MeshFeed, AnswersAreBoundedAndLoseNothing) {
  MeshFeed feed;
  std::vector<MeshBlock> blocks;
  for (int key = 0; key < 100; ++key) blocks.push_back(block(key, 10));
  feed.add(true, blocks);
  std::vector<std::int64_t> seen;
  std::uint64_t version = 0;
  for (int turn = 0; version < feed.since(version, 0).newest; ++turn) {
    const auto changes = feed.since(version, 100);
    EXPECT_EQ(changes.cleared, turn == 0);
    EXPECT_LE(changes.blocks.size(), 3u);
    for (const auto key : keys(changes)) seen.push_back(key);
    version = changes.version;
  }
  EXPECT_EQ(seen.size(), 100u);
}

TEST(MeshFeed, WhoHoldsAnotherMeshForgetsIt) {
  MeshFeed feed;
  feed.add(false, {block(1, 1)});
  const auto before = feed.since(0, SIZE_MAX);
  Mesh whole = block(0, 50'000).mesh;
  feed.set_whole(whole);
  const auto after = feed.since(before.version, SIZE_MAX);
  EXPECT_TRUE(after.cleared);
  EXPECT_EQ(after.blocks.size(), 3u) << "in parts";
  EXPECT_EQ(feed.whole().triangles.size(), whole.triangles.size());
  EXPECT_TRUE(feed.since(after.version + 1000, SIZE_MAX).cleared) << "a version of an earlier program";
}

}  // namespace
}  // namespace gelslam
