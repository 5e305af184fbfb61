// The service of a scan: what it answers.

#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "http_service_fixture.hpp"

namespace gelslam {
namespace {

using namespace test;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using namespace std::chrono_literals;

TEST_F(Service, TellsTheStateInTheWordsOfTheWindow) {
  status.track = TrackStatus::lost;
  status.state = "lost";
  status.reason = "too little overlap";
  status.advice = "touch a place you have seen";
  status.warnings = {"the disk is full"};
  const json said = state();
  EXPECT_EQ(said.at("headline"), "Lost");
  EXPECT_EQ(said.at("advice"), "Too little overlap. Touch a place you have seen.");
  EXPECT_EQ(said.at("tone"), "red");
  EXPECT_EQ(said.at("warnings"), json({"The disk is full."}));
  status.phase = LivePhase::finished;
  status.result_warnings = {"5 % of frames were dropped"};
  EXPECT_THAT(state().at("advice").get<std::string>(), HasSubstr("5 % of frames were dropped."));
  EXPECT_EQ(state().at("warnings"), json({"The disk is full."})) << "also at the end";
  const std::string page = request("GET /");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  for (const char* word : {"http:", "https:", "src=", "import("})
    EXPECT_EQ(page.find(word), std::string::npos) << "the page needs no network";
  EXPECT_THAT(request("GET /nothing"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(request("GET /picture.jpg"), HasSubstr("there is no picture yet"));
}

TEST_F(Service, CarriesOutCommandsThatTheScanAllows) {
  EXPECT_THAT(request("GET /stop"), StartsWith("HTTP/1.1 404")) << "a link must not stop a scan";
  for (const char* path : {"/undo", "/save"})
    EXPECT_THAT(request(std::string("POST ") + path), StartsWith("HTTP/1.1 404")) << path;
  EXPECT_THAT(request("POST /new"), StartsWith("HTTP/1.1 409"));
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(asked, std::vector{ScanCommand::stop});
  status.phase = LivePhase::finished;
  EXPECT_THAT(request("POST /stop"), HasSubstr("The scan is over."));
  watch.reset();
  EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 409"));
  EXPECT_EQ(state().at("headline"), "Finished") << "what was last";
}

TEST_F(Service, TrackingCanOnlyBeStoppedAndHasNothingToSave) {
  status.is_scan = false;
  EXPECT_THAT(request("POST /new"), HasSubstr("This is no scan"));
  EXPECT_TRUE(asked.empty());
  status.phase = LivePhase::finished;
  EXPECT_EQ(state().at("advice"), "");
  EXPECT_EQ(state().at("scan"), false);
}

TEST_F(Service, ShowsTheSensorWhereItWasLocalized) {
  auto tracked = std::make_shared<FrameReport>();
  auto surface = std::make_shared<Surface>();
  surface->contact = cv::Mat1b(4, 6, uchar{255});
  surface->height_mm = cv::Mat1f(4, 6, -1.0F);
  surface->contact_pixels = 24;
  tracked->surface = surface;
  map = nullptr;
  touch = tracked;
  EXPECT_EQ(state().at("touch").at("sensor").size(), 0) << "without contact, or lost";
  tracked->in_map = MapPlace{{Pose(Eigen::Translation3d(100, 0, 0))}};
  const double x = state().at("touch").at("sensor").at(0);
  tracked->in_map = MapPlace{{Pose(Eigen::Translation3d(7, 0, 0))}};
  EXPECT_NEAR(state().at("touch").at("sensor").at(0), x - 93, 1e-9);
}

TEST_F(Service, GivesLinesAsTheyCome) {
  const FileDescriptor client = connect_to(port()), tum = connect_to(port());
  say(client, "GET /poses?token=word HTTP/1.1\r\nHost: localhost\r\n\r\n");
  say(tum, "GET /poses?format=tum&token=word HTTP/1.1\r\nHost: localhost\r\n\r\n");
  hear_until(client, "\r\n\r\n");
  hear_until(tum, "\r\n\r\n");
  std::this_thread::sleep_for(1200ms);  // nothing comes for a while
  FrameReport frame{.in_map = MapPlace{{Pose(Eigen::Translation3d(0, 2, 3))}},
                    .localization = Localization{}};
  frame.tracked.frame = 17;
  frame.tracked.time_s = 0.25;
  lines.write(frame);
  EXPECT_THAT(hear_until(client, "\n\r\n"), HasSubstr("{\"type\":\"frame\",\"frame\":17,\"time_s\":0.25,"));
  EXPECT_THAT(hear_until(tum, "\n\r\n"), HasSubstr("0.25 0 0.002 0.003 0 0 0 1\n"));
  lines.close();
  EXPECT_THAT(hear_until(client, "0\r\n\r\n"), HasSubstr("0\r\n\r\n")) << "ends as HTTP ends";
  EXPECT_THAT(request("GET /poses?format=xml"), HasSubstr("should be ndjson or tum"));
  const auto bare = serve_scan({"0", "word", false}, lines, nullptr);
  const FileDescriptor other = connect_to(std::stoi(bare->urls[0].substr(bare->urls[0].rfind(':') + 1)));
  say(other, "GET /poses?format=tum&token=word HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(hear_until(other), HasSubstr("format=tum: should be ndjson"));
}

TEST_F(Service, GivesTheMeshWholeAndInBlocks) {
  EXPECT_THAT(request("GET /mesh.ply"), HasSubstr("there is no surface yet"));
  MeshBlock block;
  block.key = 5;
  block.mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  block.mesh.normals.assign(3, {0, 0, -1});
  block.mesh.confidence = {0, 2, 1e9F};
  block.mesh.triangles = {{0, 1, 2}};
  mesh.add(false, {block});
  EXPECT_THAT(body_of(request("GET /mesh.ply")), StartsWith("ply"));
  EXPECT_THAT(body_of(request("GET /mesh.glb")), StartsWith("glTF"));
  const std::string changes = body_of(request("GET /changes?since=0"));
  std::uint32_t size = 0;
  std::memcpy(&size, changes.data(), 4);
  const json head = json::parse(changes.substr(4, size));
  EXPECT_EQ(head.at("blocks"), json::array({json::array({"5", 3, 3})}))
      << "keys have more digits than numbers in JavaScript";
  ASSERT_EQ(changes.size(), 4 + size + 36 + 24 + 12);
  float y = 0;
  std::memcpy(&y, changes.data() + 4 + size + 28, 4);
  EXPECT_EQ(y, 2);
  std::array<std::int16_t, 12> normals{};
  std::memcpy(normals.data(), changes.data() + 4 + size + 36, sizeof normals);
  EXPECT_THAT(normals, testing::ElementsAre(0, 0, -32767, 0, 0, 0, -32767, 512, 0, 0, -32767, 32767));
  EXPECT_EQ(changes[4 + size + 60 + 4], 1);
  const std::string nothing = request("GET /changes?since=" + head.at("version").dump());
  EXPECT_THAT(nothing, HasSubstr("\"blocks\":[]"));
}

TEST_F(Service, AMeshThatCannotBeWrittenLeavesNothing) {
  const TemporaryFolder folder;
  const char* const before = std::getenv("TMPDIR");
  const std::string old = before == nullptr ? "/tmp" : before;
  ::setenv("TMPDIR", folder.path().c_str(), 1);
  MeshBlock block;
  block.mesh.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  block.mesh.normals.assign(2, {0, 0, -1});
  block.mesh.confidence.assign(3, 1);
  block.mesh.triangles = {{0, 1, 2}};
  mesh.add(false, {block});
  EXPECT_THAT(request("GET /mesh.glb"), StartsWith("HTTP/1.1 500"));
  ::setenv("TMPDIR", old.c_str(), 1);
  EXPECT_TRUE(folder.names().empty());
}

TEST_F(Service, RefusesOtherSites) {
  const std::string own = "Host: 127.0.0.1:" + std::to_string(port()) + "\r\n";
  EXPECT_THAT(request("GET /status", own), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(request("POST /stop", own + "Origin: http://evil.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(request("POST /stop", own + "Origin: null\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop", own + "Origin: http://127.0.0.1:" + std::to_string(port()) + "\r\n"),
              StartsWith("HTTP/1.1 200"));
}

/// Other users of this machine may not end a scan, either.
TEST_F(Service, NeedsItsTokenForEverything) {
  for (const std::string path : {"GET /", "GET /poses", "GET /mesh.ply", "POST /stop"})
    for (const char* wrong : {"", "?token=", "?token=wore", "?token=words"})
      EXPECT_THAT(request_of_anybody(path + wrong), StartsWith("HTTP/1.1 403")) << path << wrong;
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 200"));
}

TEST_F(Service, NamesEveryAddressOfThisMachineAndATokenOfItsOwn) {
  EXPECT_EQ(service->urls.front(), "http://127.0.0.1:" + std::to_string(port()) + "/?token=word");
  LineFeed other_lines;
  const auto open = serve_scan({"0.0.0.0:0", ""}, other_lines, nullptr);
  EXPECT_THAT(open->urls, testing::Each(testing::MatchesRegex("http://[0-9.]+:[0-9]+/\\?token=[0-9a-f]+")));
  EXPECT_THAT(open->urls, testing::Contains(StartsWith("http://127.0.0.1:")));
  const std::string& url = open->urls.front();
  EXPECT_EQ(url.size() - url.rfind('=') - 1, 32u);
  EXPECT_THAT(serve_scan({"[::]:0", "longword"}, other_lines, nullptr)->urls,
              testing::Each(StartsWith("http://[")));
}

TEST_F(Service, TellsThePageWhatIsNewOfTheWay) {
  auto moved = std::make_shared<MapSnapshot>();
  moved->version = 7;
  for (int i = 0; i < 4; ++i) {
    MapSnapshot::Node node;
    node.keyframe = i;
    node.trial = i / 2;
    node.placed = i != 3;
    node.component_T_keyframe.translation().x() = i;
    moved->nodes.push_back(node);
  }
  map = moved;
  const json whole = json::parse(R"({"kept": 0, "points": [[0, 0, 0, 0], [0, 1, 0, 0], [1, 2, 0, 0]]})");
  const json first = changes("since=0&map=6");
  EXPECT_EQ(first.at("path"), whole);
  EXPECT_EQ(first.at("map"), "7");
  EXPECT_FALSE(changes("since=0&map=7").contains("path"));
  EXPECT_EQ(changes("since=0&map=7&page=other").at("path"), whole);
  moved = std::make_shared<MapSnapshot>(*moved);
  moved->version = 8;
  moved->nodes[2].component_T_keyframe.translation().y() = 0.5;
  moved->nodes[3].placed = true;
  map = moved;
  EXPECT_EQ(changes("since=0&map=7").at("path"),
            json::parse(R"({"kept": 2, "points": [[1, 2, 0.5, 0], [1, 3, 0, 0]]})"));
  EXPECT_EQ(changes("since=0&map=7").at("path").at("kept"), 0) << "the answer before was lost";
}

TEST_F(Service, TheEndWaitsForEveryOpenPage) {
  status.phase = LivePhase::finished;
  MeshBlock block;
  block.mesh.vertices_mm.assign(100'000, {0, 0, 0});  // more than one answer holds
  block.mesh.triangles = {{0, 1, 2}};
  mesh.add(false, {block});
  block.key = 1;
  mesh.add(false, {block});
  changes("since=0&page=a");
  const std::string newest = changes("since=0&page=b").at("newest").dump();
  watch.reset();
  lines.close();
  std::atomic<bool> ended{false};
  std::thread end([&] {
    service->finish();
    ended = true;
  });
  std::this_thread::sleep_for(1500ms);
  const std::string all = "since=" + newest + "&phase=finished&page=";
  changes(all + "a");
  std::this_thread::sleep_for(500ms);
  EXPECT_FALSE(ended) << "b has not all of the mesh";
  changes("since=" + newest + "&page=b");
  std::this_thread::sleep_for(200ms);
  EXPECT_FALSE(ended) << "the answer may be on its way";
  changes(all + "b");
  const auto told = std::chrono::steady_clock::now();
  end.join();
  EXPECT_LT(std::chrono::steady_clock::now() - told, 500ms);
}

std::string refusal_of(const std::string& address, const std::string& token = "") {
  LineFeed lines;
  try {
    serve_scan({address, token}, lines, nullptr);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(Service, RefusesInOneLineWhatCannotBe) {
  const std::string taken = std::to_string(port());
  EXPECT_EQ(refusal_of(taken), "port " + taken + " is in use by another program; choose another one");
  for (const char* address : {"", "x", "-1", "70000", "80a", ":80", "localhost:"})
    EXPECT_THAT(refusal_of(address), HasSubstr("a port is a number from 1 to 65535")) << address;
  EXPECT_THAT(refusal_of("203.0.113.7:0"), HasSubstr("is no address of this machine"));
  EXPECT_EQ(refusal_of("localhost:0", "a-B_9"), "accepted");
  EXPECT_THAT(refusal_of("0.0.0.0:0", "short"), HasSubstr("--token: others can guess it"));
  for (const char* token : {"a b", "a&b", "\u00e4"})
    EXPECT_THAT(refusal_of("localhost:0", token), HasSubstr("should have letters")) << token;
  EXPECT_THAT(request("GET /changes?since=-1"), StartsWith("HTTP/1.1 200"));
}

}  // namespace
}  // namespace gelslam
