#include "cameras/capture_stream.hpp"

#include <linux/videodev2.h>
#include <sys/mman.h>

#include <cerrno>
#include <thread>

namespace gelslam::detail {
namespace {

constexpr std::uint32_t kBuffersAsked = 4;  // enough for a delay of 160 ms at 25 Hz
constexpr auto kPauseWhenNotReady = std::chrono::milliseconds(5);

v4l2_buffer empty_buffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

/// steady_clock is that clock on Linux.
std::optional<std::chrono::steady_clock::time_point> monotonic_time(const v4l2_buffer& buffer) {
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool given = buffer.timestamp.tv_sec != 0 || buffer.timestamp.tv_usec != 0;
  if (!monotonic || !given) return std::nullopt;
  using namespace std::chrono;
  return steady_clock::time_point(seconds(buffer.timestamp.tv_sec) + microseconds(buffer.timestamp.tv_usec));
}

}  // namespace

CaptureStream::CaptureStream(const VideoNode& node) : node_(node) {
  try {
    map_buffers();
    for (std::uint32_t i = 0; i < buffers_.size(); ++i) queue(i);
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    node_.require(VIDIOC_STREAMON, &type, "start the stream");
  } catch (...) {
    unmap_buffers();
    throw;
  }
}

CaptureStream::~CaptureStream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  node_.call(VIDIOC_STREAMOFF, &type);
  unmap_buffers();
}

void CaptureStream::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffersAsked;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  node_.require(VIDIOC_REQBUFS, &request, "get buffers");
  if (request.count < 2)
    throw Error(node_.path() + ": the driver gives only " + std::to_string(request.count) +
                " buffers; two are needed");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = empty_buffer(i);
    node_.require(VIDIOC_QUERYBUF, &buffer, "get buffers");
    void* address = node_.system().map(buffer.length, node_.fd(), static_cast<off_t>(buffer.m.offset));
    if (address == MAP_FAILED) throw camera_failure(node_.system(), node_.path(), "map its buffers", errno);
    buffers_.emplace_back(static_cast<std::uint8_t*>(address), buffer.length);
  }
}

void CaptureStream::unmap_buffers() {
  for (const auto& buffer : buffers_) node_.system().unmap(buffer.data(), buffer.size());
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  node_.call(VIDIOC_REQBUFS, &none);  // frees them, so that the next one to open gets its own
  buffers_.clear();
}

void CaptureStream::queue(std::uint32_t index) {
  v4l2_buffer buffer = empty_buffer(index);
  node_.require(VIDIOC_QBUF, &buffer, "queue a buffer");
}

Capture CaptureStream::take(int wait_ms, CapturedFrame& frame) {
  pollfd waiting{node_.fd(), POLLIN, 0};
  const int ready = node_.system().poll(&waiting, 1, wait_ms);
  if (ready == 0) return Capture::nothing_yet;
  if (ready < 0 && errno != EINTR)
    throw camera_failure(node_.system(), node_.path(), "wait for a frame", errno);
  // Whatever poll says, the queue knows best: an unplugged camera answers with ENODEV here.
  v4l2_buffer buffer = empty_buffer(0);
  if (const int code = node_.call(VIDIOC_DQBUF, &buffer); code != 0) {
    if (code != EAGAIN) throw camera_failure(node_.system(), node_.path(), "get a frame", code);
    std::this_thread::sleep_for(kPauseWhenNotReady);
    return Capture::nothing_yet;
  }
  frame.arrived = std::chrono::steady_clock::now();
  if (buffer.index >= buffers_.size()) throw camera_failure(node_.system(), node_.path(), "get a frame", EIO);
  const auto& memory = buffers_[buffer.index];
  const bool usable =
      (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused > 0 && buffer.bytesused <= memory.size();
  if (usable) frame.bytes.assign(memory.begin(), memory.begin() + buffer.bytesused);
  frame.sequence = buffer.sequence;
  frame.captured = monotonic_time(buffer);
  queue(buffer.index);
  return usable ? Capture::frame : Capture::damaged;
}

}  // namespace gelslam::detail
