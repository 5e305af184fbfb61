// The service of a scan, and clients that mean no good.

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "gelslam/core/process.hpp"
#include "http_service_fixture.hpp"

namespace gelslam {
namespace {

using namespace test;
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using namespace std::chrono_literals;

/// As in a container with a limit on processes, which counts threads. In a process of its own.
[[noreturn]] void serve_with_few_threads() {
  rlimit few{};
  few.rlim_cur = few.rlim_max = 24;
  ::setrlimit(RLIMIT_NPROC, &few);
  if (::setresuid(54321, 54321, 54321) != 0) std::_Exit(0);  // of root there is no limit
  LineFeed lines;
  const auto service = serve_scan({"0", "word"}, lines, nullptr);
  const std::string& url = service->urls.at(0);
  const FileDescriptor client = connect_to(std::stoi(url.substr(url.rfind(':') + 1)));
  say(client, "GET /status?token=word HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  std::_Exit(hear_until(client).starts_with("HTTP/1.1 200") ? 0 : 1);
}

TEST(ServiceOfFewThreads, TakesAsManyClientsAsThereAreThreads) {
  EXPECT_EXIT(serve_with_few_threads(), testing::ExitedWithCode(0), "");
}

TEST_F(Service, ClientsThatHaveLeftDoNotDelayTheEnd) {
  MeshBlock block;
  for (int i = 0; i < 100'000; ++i) {
    const auto x = static_cast<float>(i);
    block.mesh.vertices_mm.insert(block.mesh.vertices_mm.end(), {{x, 0, 0}, {x, 1, 0}, {x, 0, 1}});
    block.mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  block.mesh.normals.assign(block.mesh.vertices_mm.size(), {0, 0, -1});
  mesh.add(false, {block});
  const auto begin = std::chrono::steady_clock::now();
  request("GET /mesh.glb");
  const auto one = std::chrono::steady_clock::now() - begin;
  for (int k = 0; k < 150; ++k)
    say(connect_to(port()), "GET /mesh.glb?token=word HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const FileDescriptor stalled = connect_to(port(), 4096);
  say(stalled, "GET /mesh.ply?token=word HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::this_thread::sleep_for(200ms);
  lines.close();
  const auto end = std::chrono::steady_clock::now();
  watch.reset();
  service->finish();
  service.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - end, 4 * one + 12s) << "as long as one is made, and sent";
}

TEST_F(Service, DropsRequestsThatAreTooLarge) {
  const std::int64_t before = dropped();
  for (const std::string& text :
       {"GET /" + std::string(1 << 22, 'a'),
        "GET /status?token=word HTTP/1.1\r\nA: " + std::string(1 << 22, 'a'),
        "POST /stop?token=word HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" +
            std::string("fffffff\r\n") + std::string(1 << 22, 'a')}) {
    const FileDescriptor client = connect_to(port());
    say(client, text);
    ::shutdown(client.get(), SHUT_WR);
    EXPECT_EQ(hear_until(client).find("HTTP/1.1 200"), std::string::npos);
  }
  EXPECT_TRUE(asked.empty());
  EXPECT_GT(dropped(), before);
}

/// A byte every now and then, for ever: of a request's headers, without a token.
TEST_F(Service, RequestsThatTrickleKeepNobodyOutAndDelayNoEnd) {
  std::vector<FileDescriptor> slow;
  for (int k = 0; k < 200; ++k) {
    slow.push_back(connect_to(port()));
    say(slow.back(), "GET /status HTTP/1.1\r\nA: ");
  }
  std::atomic<bool> over{false};
  std::jthread trickle([&] {
    while (!over) {
      for (const FileDescriptor& client : slow) say(client, "x");
      std::this_thread::sleep_for(100ms);
    }
  });
  for (int k = 0; k < 10; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_THAT(request("POST /stop"), StartsWith("HTTP/1.1 200"));
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
  }
  const FileDescriptor last = connect_to(port());
  for (int k = 0; k < 100 && say(last, "x"); ++k) std::this_thread::sleep_for(100ms);
  EXPECT_FALSE(say(last, "x")) << "5 s for a request, whatever comes of it";
  slow.push_back(connect_to(port()));
  lines.close();
  const auto end = std::chrono::steady_clock::now();
  watch.reset();
  service->finish();
  service.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - end, 3s);
  over = true;
}

TEST_F(Service, EndlessLinesAreNotKept) {
  const double memory_mb = resident_memory_mb();
  std::vector<FileDescriptor> clients;
  for (int k = 0; k < 8; ++k) {
    clients.push_back(connect_to(port()));
    for (int mb = 0; mb < 20 && say(clients.back(), std::string(1 << 20, 'a')); ++mb) {
    }
  }
  EXPECT_LT(resident_memory_mb() - memory_mb, 30);
}

/// Descriptors are left for the files of a scan that ends.
TEST_F(Service, ManyConnectionsLeaveRoomForFiles) {
  const auto open_files = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  const auto before = open_files();
  std::vector<FileDescriptor> clients;
  for (int k = 0; k < 400; ++k) clients.push_back(connect_to(port()));
  const auto end = std::chrono::steady_clock::now() + 10s;
  while (open_files() - before - 400 > 65 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(100ms);
  EXPECT_LE(open_files() - before - 400, 65);
}

TEST_F(Service, ManyRangesAreNoProblem) {
  std::string ranges = "Range: bytes=0-1";
  while (ranges.size() < 8000) ranges += ",0-1";
  const std::string host = "Host: localhost\r\n", whole = body_of(request("GET /"));
  for (const std::string& some :
       {ranges, std::string("Range: bytes=5-9"), std::string("Range: bytes=0-,0-,5-")}) {
    const std::string answer = request("GET /", host + some + "\r\n");
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(answer, HasSubstr("Content-Length: " + std::to_string(whole.size()) + "\r\n"))
        << some.substr(0, 40);
    EXPECT_TRUE(body_of(answer) == whole) << "the whole is a right answer to any range";
  }
  EXPECT_THAT(request("POST /stop", host + "Content-Length: -5\r\n"), StartsWith("HTTP/1.1 413"));
  EXPECT_TRUE(asked.empty());
  EXPECT_THAT(request("GET /status"), StartsWith("HTTP/1.1 200"));
}

TEST_F(Service, ClientsThatDoNothingKeepNobodyOut) {
  const double memory_mb = resident_memory_mb();
  std::vector<FileDescriptor> idle;
  for (int k = 0; k < 200; ++k) {
    idle.push_back(connect_to(port()));
    if (k % 2 == 0) say(idle.back(), "GET /status HT");  // half a request
  }
  const auto begin = std::chrono::steady_clock::now();
  bool answered = false;
  while (!answered && std::chrono::steady_clock::now() - begin < 15s) {
    answered = request("GET /status").starts_with("HTTP/1.1 200");
    if (!answered) std::this_thread::sleep_for(200ms);
  }
  EXPECT_TRUE(answered);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 8s) << "5 s for a request, on a busy machine";
  EXPECT_LT(resident_memory_mb() - memory_mb, 50);
}

TEST_F(Service, AReaderThatStallsDelaysNobodyAndIsDropped) {
  const FileDescriptor stalled = connect_to(port(), 4096), quick = connect_to(port());
  for (const FileDescriptor* client : {&stalled, &quick}) {
    say(*client, "GET /poses?token=word HTTP/1.1\r\nHost: localhost\r\n\r\n");
    hear_until(*client, "\r\n\r\n");
  }
  const FrameReport large{.localization = Localization{.reason = std::string(100'000, 'x')}};
  for (int k = 0; k < 100; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    lines.write(large);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);
    EXPECT_THAT(hear_until(quick, "\n\r\n"), HasSubstr("xxx"));
  }
  for (int k = 0; k < 100 && dropped() == 0; ++k) std::this_thread::sleep_for(100ms);
  EXPECT_EQ(dropped(), 1);
}

}  // namespace
}  // namespace gelslam
