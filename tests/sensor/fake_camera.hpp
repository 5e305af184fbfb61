#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cameras/v4l2_camera.hpp"

namespace gelslam::test {

/// What the fake driver's queue gives next: a frame, or an errno.
struct FakeFrame {
  std::vector<std::uint8_t> bytes = {0xff, 0xd8, 0xff, 0xd9};
  std::uint32_t sequence = 0;
  double time_s = 0;
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  int code = 0;
  std::optional<double> arrives_s = {};  ///< on the clock of `time_s`; none: when it is taken
};

struct FakeMode {
  std::uint32_t fourcc = V4L2_PIX_FMT_MJPEG, width = 3280, height = 2464;
  std::vector<std::uint32_t> rates_hz = {25};
};

struct FakeControl {
  std::string title;
  std::int32_t value = 0, minimum = 0, maximum = 255;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  int refuses = 0;                                 ///< errno of every write
  std::function<void(std::int32_t)> written = {};  ///< what the hardware does besides
};

/// One node of an emulated V4L2 driver, after the kernel's documentation: it keeps the rules of the buffer
/// queue and answers like a camera, healthy until a test breaks it.
class FakeCamera {
 public:
  std::string path = "/dev/video0", card = "GelSight Mini R0B 28KX", bus = "usb-0000:00:14.0-2";
  std::uint32_t device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<FakeMode> modes = {{}};
  std::map<std::uint32_t, FakeControl> controls;
  std::deque<FakeFrame> frames;
  std::uint32_t most_buffers = 32, row_gap_bytes = 0;
  std::string group = "video", holder;
  double forced_rate_hz = 0;           ///< granted instead of what is asked; below 0: the call is not known
  std::map<unsigned long, int> fails;  ///< errno by request
  std::map<unsigned long, int> fails_times;  ///< only so many times; without an entry for ever
  int open_fails = 0, map_fails = 0;
  bool endless_lists = false;  ///< a broken driver whose lists do not end

  std::vector<unsigned long> calls;  ///< requests that came, in order
  int open_count = 0, mapped_count = 0;
  bool streaming = false;
  std::int64_t unix_offset_us =
      1'700'000'000'000'000;     ///< what the system's clock is ahead of the monotonic one
  std::optional<double> now_s;   ///< none: that of this machine
  std::function<void()> polled;  ///< called when a program begins to wait for a frame

  int open();
  int ioctl(unsigned long request, void* argument);
  void* map(std::size_t length, off_t offset);
  int poll(int timeout_ms);

 private:
  const FakeMode& nearest_mode(const v4l2_pix_format& asked) const;
  int answer(unsigned long request, void* argument);
  int capability(v4l2_capability& capability);
  int enumerate_formats(v4l2_fmtdesc& format);
  int enumerate_sizes(v4l2_frmsizeenum& size);
  int enumerate_rates(v4l2_frmivalenum& interval);
  int set_format(v4l2_format& format);
  int set_rate(v4l2_streamparm& parameters);
  int request_buffers(v4l2_requestbuffers& request);
  int query_buffer(v4l2_buffer& buffer);
  int queue(v4l2_buffer& buffer);
  int dequeue(v4l2_buffer& buffer);
  int query_control(v4l2_queryctrl& query);
  int get_control(v4l2_control& control);
  int set_control(const v4l2_control& control);

  std::vector<std::uint32_t> offered_rates_hz_;  ///< in the mode that was set
  std::vector<std::vector<std::uint8_t>> memory_;
  std::set<std::uint32_t> queued_;
};

/// The fake nodes as a system: file descriptors are their numbers from 100.
detail::VideoSystem fake_system(const std::vector<FakeCamera*>& cameras);

}  // namespace gelslam::test
