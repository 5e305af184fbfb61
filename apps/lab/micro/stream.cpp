// What a stream adds between a frame's pose and the line in another program: text, queue, thread and socket.

#include <arpa/inet.h>
#include <benchmark/benchmark.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

#include "gelslam/slam/pose_stream.hpp"
#include "gelslam/slam/stream_server.hpp"
#include "studies/simulated_frames.hpp"

namespace gelslam {
namespace {

int connect_to(const StreamServer& server) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port =
      htons(static_cast<std::uint16_t>(std::stoi(server.name().substr(server.name().rfind(':') + 1))));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return -1;
  while (server.reader_count() == 0) ::usleep(1000);
  return fd;
}

bool read_line(int fd) {
  char bytes[8192];
  while (true) {
    const ssize_t count = ::recv(fd, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    if (bytes[count - 1] == '\n') return true;
  }
}

TrackedFrame tracked_frame() {
  TrackedFrame frame;
  frame.status = TrackStatus::tracked;
  frame.trial = 0;
  frame.keyframe = std::make_shared<const Keyframe>();
  return frame;
}

FrameReport report_of(const TrackedFrame& frame) {
  FrameReport report{frame, lab::simulated_frames().surfaces[0].get()};
  report.covariance = Matrix6d::Identity() / 3.0;
  return report;
}

/// A frame of tracked contact to a line read at the other end of a socket.
void pose_to_line_read(benchmark::State& state) {
  StreamServer server("tcp:0", "127.0.0.1", [](std::int64_t) { return std::string("\n"); });
  const int fd = connect_to(server);
  const TrackedFrame frame = tracked_frame();
  const FrameReport report = report_of(frame);
  for (auto _ : state) {
    server.write(ndjson_line(report));
    if (!read_line(fd)) state.SkipWithError("the line did not come");
  }
  ::close(fd);
}

/// The tracker's share of it.
void line_of_a_frame(benchmark::State& state) {
  const TrackedFrame frame = tracked_frame();
  const FrameReport report = report_of(frame);
  for (auto _ : state) benchmark::DoNotOptimize(ndjson_line(report).size());
}

BENCHMARK(pose_to_line_read)->Name("stream/pose_to_line_read")->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(line_of_a_frame)->Name("stream/line_of_a_frame")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gelslam
