// Readers of a stream: sockets that are opened, read too slowly, and left.

#include "gelslam/slam/stream_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

static std::atomic<int> polls = 0;  // of all threads

/// In place of the system's: counts how often somebody waits.
extern "C" int poll(pollfd* files, nfds_t count, int timeout_ms) {
  ++polls;
  const timespec timeout{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000L};
  return ::ppoll(files, count, timeout_ms < 0 ? nullptr : &timeout, nullptr);
}

namespace gelslam {
namespace {

using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

std::string notice(std::int64_t lines) { return "lost " + std::to_string(lines) + "\n"; }

int port_of(const StreamServer& server) {
  return std::stoi(server.name().substr(server.name().rfind(':') + 1));
}

/// A client with plain sockets.
class Client {
 public:
  explicit Client(int port, int receive_bytes = 0) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_bytes > 0) ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  explicit Client(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Client() { ::close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// "" at the end of the stream.
  std::string line() {
    while (true) {
      if (const std::size_t end = text_.find('\n'); end != std::string::npos) {
        std::string line = text_.substr(0, end);
        text_.erase(0, end + 1);
        return line;
      }
      char bytes[4096];
      const ssize_t count = ::recv(fd_, bytes, sizeof bytes, 0);
      if (count <= 0) return "";
      text_.append(bytes, static_cast<std::size_t>(count));
    }
  }

 private:
  int fd_;
  std::string text_;
};

void wait_for_readers(const StreamServer& server, int count) {
  for (int k = 0; k < 500 && server.reader_count() != count; ++k) std::this_thread::sleep_for(10ms);
  ASSERT_EQ(server.reader_count(), count);
}

std::string refusal(const std::string& target) {
  try {
    const StreamServer server(target, notice);
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(StreamServer, ASlowReaderLosesTheOldestAndIsToldWhileOthersGetAll) {
  StreamServer server("tcp:0", notice);
  Client slow(port_of(server), 4096), quick(port_of(server));
  wait_for_readers(server, 2);
  constexpr int kLines = 3000;
  const std::string filling(10'000, 'x');  // more than the system's buffers hold
  for (int k = 0; k < kLines; ++k) {
    server.write(std::to_string(k) + filling + "\n");
    ASSERT_EQ(quick.line(), std::to_string(k) + filling);
  }
  int next = 0, lost = 0;
  while (next < kLines) {
    const std::string line = slow.line();
    ASSERT_NE(line, "");
    if (line.starts_with("lost ")) {
      lost += std::stoi(line.substr(5));
      next += std::stoi(line.substr(5));
    } else {
      ASSERT_EQ(std::stoi(line), next++) << "the oldest are lost, and exactly as many as is said";
      ASSERT_EQ(line.size(), filling.size() + std::to_string(next - 1).size()) << "no line is cut";
    }
  }
  EXPECT_GT(lost, 100);
}

TEST(StreamServer, AReaderThatIsGoneIsForgottenAndMayComeBack) {
  StreamServer server("tcp:0", notice);
  for (int visit = 0; visit < 3; ++visit) {
    {
      Client client(port_of(server));
      wait_for_readers(server, 1);
      server.write("hello\n");
      EXPECT_EQ(client.line(), "hello");
    }
    for (int k = 0; k < 500 && server.reader_count() > 0; ++k) {
      server.write("anybody?\n");
      std::this_thread::sleep_for(10ms);
    }
    ASSERT_EQ(server.reader_count(), 0);
  }
}

TEST(StreamServer, KeptLinesComeFirstToWhoeverConnectsLater) {
  StreamServer server("tcp:0", notice);
  server.write_and_keep(9, "map 1\n");
  server.write_and_keep(0, "keyframe 0\n");
  server.write_and_keep(9, "map 2\n");
  server.write("frame\n");
  Client client(port_of(server));
  wait_for_readers(server, 1);
  server.write("next frame\n");
  EXPECT_EQ(client.line(), "keyframe 0");
  EXPECT_EQ(client.line(), "map 2");
  EXPECT_EQ(client.line(), "next frame");
  server.forget_kept();
  Client late(port_of(server));
  wait_for_readers(server, 2);
  server.write("last frame\n");
  EXPECT_EQ(late.line(), "last frame");
}

TEST(StreamServer, WaitsWhileThereIsNoFileDescriptorForAReader) {
  StreamServer server("tcp:0", notice);
  const Client first(port_of(server));
  wait_for_readers(server, 1);
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  const int next_fd = ::dup(0);
  ::close(next_fd);
  const rlimit full{static_cast<rlim_t>(next_fd) + 1, limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &full), 0);
  Client second(port_of(server));  // takes the last descriptor
  const auto begin = std::chrono::steady_clock::now();
  const int before = polls;
  std::this_thread::sleep_for(300ms);
  const int waits = polls - before;
  EXPECT_GT(waits, 0);
  // It tries again after 100 ms at least, and looks whether to end twice in between.
  EXPECT_LE(waits, 3 * ((std::chrono::steady_clock::now() - begin) / 100ms) + 4) << "the server spins";
  EXPECT_EQ(server.reader_count(), 1);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
  wait_for_readers(server, 2);
  server.write("hello\n");
  EXPECT_EQ(second.line(), "hello");
}

TEST(StreamServer, WhatIsQueuedStillComesAtTheEnd) {
  auto server = std::make_unique<StreamServer>("tcp:0", notice);
  Client client(port_of(*server));
  wait_for_readers(*server, 1);
  for (int k = 0; k < 100; ++k) server->write(std::to_string(k) + "\n");
  server.reset();
  for (int k = 0; k < 100; ++k) ASSERT_EQ(client.line(), std::to_string(k));
  EXPECT_EQ(client.line(), "");
}

/// While it lives, standard output goes to another descriptor.
struct RedirectedOutput {
  explicit RedirectedOutput(int fd) : saved(::dup(STDOUT_FILENO)) { ::dup2(fd, STDOUT_FILENO); }
  ~RedirectedOutput() {
    ::dup2(saved, STDOUT_FILENO);
    ::close(saved);
  }
  const int saved;
};

TEST(StreamServer, AFullDiskIsAFailureAndAReaderThatLeftIsNot) {
  std::fflush(stdout);
  const int full = ::open("/dev/full", O_WRONLY);
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  ::close(pipe_ends[0]);
  for (const auto& [fd, good] : {std::pair(full, false), std::pair(pipe_ends[1], true)}) {
    const RedirectedOutput redirected(fd);
    StreamServer server("-", notice);
    server.write("line\n");
    EXPECT_EQ(server.finish(), good);
  }
  ::close(full);
  ::close(pipe_ends[1]);
}

TEST(StreamServer, ASocketFileIsMadeAndTakenAway) {
  const TemporaryFolder folder;
  const std::string path = (folder / "poses").string();
  {
    StreamServer server("unix:" + path, notice);
    Client client(path);
    wait_for_readers(server, 1);
    EXPECT_THAT(refusal("unix:" + path), HasSubstr("in use by another program"));
    server.write("hello\n");
    EXPECT_EQ(client.line(), "hello");
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(StreamServer, AnAbandonedSocketFileIsReplacedAndAnyOtherStays) {
  const TemporaryFolder folder;
  const std::string path = (folder / "poses").string();
  {
    const int left_behind = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    ASSERT_EQ(::bind(left_behind, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    ::close(left_behind);
  }
  ASSERT_TRUE(std::filesystem::exists(path));
  EXPECT_EQ(refusal("unix:" + path), "accepted");
  std::ofstream(path) << "mine";
  EXPECT_THAT(refusal("unix:" + path), HasSubstr("there is a file of that name"));
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(StreamServer, RefusesInOneLineWhatCannotBe) {
  const StreamServer server("tcp:0", notice);
  const std::string port = std::to_string(port_of(server));
  EXPECT_EQ(refusal("tcp:" + port), "port " + port + " is in use by another program; choose another one");
  for (const char* port_text : {"", "x", "-1", "70000", "80a"})
    EXPECT_THAT(refusal(std::string("tcp:") + port_text), HasSubstr("a port is a number")) << port_text;
  EXPECT_THAT(refusal("udp:5"), HasSubstr("should be -, unix:PATH or tcp:PORT"));
  EXPECT_THAT(refusal("unix:"), HasSubstr("characters"));
  EXPECT_THAT(refusal("unix:" + std::string(200, 'a')), HasSubstr("characters"));
  EXPECT_THAT(refusal("unix:/no/such/folder/poses"), HasSubstr("No such file"));
}

}  // namespace
}  // namespace gelslam
