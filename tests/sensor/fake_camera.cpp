#include "fake_camera.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <functional>
#include <thread>

namespace gelslam::test {
namespace {

constexpr int kFirstFd = 100;
constexpr std::size_t kBufferBytes = 1 << 20;

template <std::size_t size>
void put(std::uint8_t (&field)[size], const std::string& text) {
  std::memcpy(field, text.data(), std::min(size, text.size()));  // a full field has no final zero
}

}  // namespace

int FakeCamera::open() {
  if (open_fails != 0) {
    errno = open_fails;
    return -1;
  }
  ++open_count;
  return 0;
}

/// The asked mode, else the first of its format, else the first of all.
const FakeMode& FakeCamera::nearest_mode(const v4l2_pix_format& asked) const {
  const FakeMode* nearest = nullptr;
  for (const FakeMode& mode : modes) {
    if (mode.fourcc != asked.pixelformat) continue;
    if (nearest == nullptr || (mode.width == asked.width && mode.height == asked.height)) nearest = &mode;
  }
  return nearest == nullptr ? modes.front() : *nearest;
}

int FakeCamera::capability(v4l2_capability& capability) {
  put(capability.driver, "uvcvideo");
  put(capability.card, card);
  put(capability.bus_info, bus);
  // The whole device can do both, whichever node is asked.
  capability.capabilities =
      V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  capability.device_caps = device_caps;
  return 0;
}

int FakeCamera::enumerate_formats(v4l2_fmtdesc& format) {
  std::vector<std::uint32_t> formats;
  for (const FakeMode& mode : modes) {
    if (std::find(formats.begin(), formats.end(), mode.fourcc) == formats.end())
      formats.push_back(mode.fourcc);
  }
  if (format.index >= formats.size() && !endless_lists) return EINVAL;
  format.pixelformat = formats[format.index % formats.size()];
  return 0;
}

int FakeCamera::enumerate_sizes(v4l2_frmsizeenum& size) {
  std::vector<FakeMode> fitting;
  for (const FakeMode& mode : modes) {
    if (mode.fourcc == size.pixel_format) fitting.push_back(mode);
  }
  if (fitting.empty() || (size.index >= fitting.size() && !endless_lists)) return EINVAL;
  size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  size.discrete = {fitting[size.index % fitting.size()].width, fitting[size.index % fitting.size()].height};
  return 0;
}

int FakeCamera::enumerate_rates(v4l2_frmivalenum& interval) {
  const auto mode = std::find_if(modes.begin(), modes.end(), [&](const FakeMode& m) {
    return m.fourcc == interval.pixel_format && m.width == interval.width && m.height == interval.height;
  });
  if (mode == modes.end() || mode->rates_hz.empty()) return EINVAL;
  if (interval.index >= mode->rates_hz.size() && !endless_lists) return EINVAL;
  interval.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  interval.discrete = {1, mode->rates_hz[interval.index % mode->rates_hz.size()]};
  return 0;
}

/// As the kernel's drivers do: what is not there is quietly replaced by something that is.
int FakeCamera::set_format(v4l2_format& format) {
  if (format.type != V4L2_BUF_TYPE_VIDEO_CAPTURE || streaming) return streaming ? EBUSY : EINVAL;
  const FakeMode& mode = nearest_mode(format.fmt.pix);
  offered_rates_hz_ = mode.rates_hz;
  format.fmt.pix.pixelformat = mode.fourcc;
  format.fmt.pix.width = mode.width;
  format.fmt.pix.height = mode.height;
  format.fmt.pix.bytesperline = mode.fourcc == V4L2_PIX_FMT_YUYV ? 2 * mode.width + row_gap_bytes : 0;
  return 0;
}

int FakeCamera::set_rate(v4l2_streamparm& parameters) {
  if (forced_rate_hz < 0) return ENOTTY;
  v4l2_fract& interval = parameters.parm.capture.timeperframe;
  const double asked_hz = static_cast<double>(interval.denominator) / interval.numerator;
  const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
    return std::abs(a - asked_hz) < std::abs(b - asked_hz);
  };
  if (!offered_rates_hz_.empty())
    interval = {1, *std::min_element(offered_rates_hz_.begin(), offered_rates_hz_.end(), nearer)};
  if (forced_rate_hz > 0) interval = {1000, static_cast<std::uint32_t>(std::lround(1000 * forced_rate_hz))};
  return 0;
}

int FakeCamera::request_buffers(v4l2_requestbuffers& request) {
  if (streaming) return EBUSY;
  if (mapped_count > 0) return EBUSY;  // vb2 refuses while the program still has them mapped
  request.count = std::min(request.count, most_buffers);
  memory_.assign(request.count, std::vector<std::uint8_t>(kBufferBytes));
  queued_.clear();
  return 0;
}

int FakeCamera::query_buffer(v4l2_buffer& buffer) {
  if (buffer.index >= memory_.size()) return EINVAL;
  buffer.length = kBufferBytes;
  buffer.m.offset = static_cast<std::uint32_t>(buffer.index * kBufferBytes);
  return 0;
}

int FakeCamera::queue(v4l2_buffer& buffer) {
  if (buffer.index >= memory_.size() || buffer.memory != V4L2_MEMORY_MMAP) return EINVAL;
  return queued_.insert(buffer.index).second ? 0 : EINVAL;
}

int FakeCamera::dequeue(v4l2_buffer& buffer) {
  if (!streaming || queued_.empty()) return EINVAL;
  if (frames.empty()) return EAGAIN;
  const FakeFrame frame = frames.front();
  if (frame.code != 0) return frame.code;
  frames.pop_front();
  now_s = frame.arrives_s;
  buffer.index = *queued_.begin();
  queued_.erase(queued_.begin());
  std::copy(frame.bytes.begin(), frame.bytes.end(), memory_[buffer.index].begin());
  buffer.bytesused = static_cast<std::uint32_t>(frame.bytes.size());
  buffer.sequence = frame.sequence;
  buffer.flags = frame.flags;
  buffer.timestamp.tv_sec = static_cast<long>(frame.time_s);
  buffer.timestamp.tv_usec = std::lround((frame.time_s - std::floor(frame.time_s)) * 1e6);
  return 0;
}

int FakeCamera::query_control(v4l2_queryctrl& query) {
  const std::uint32_t after = query.id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
  auto found = controls.upper_bound(after);
  if (found == controls.end()) {
    if (!endless_lists || controls.empty()) return EINVAL;
    found = controls.begin();
  }
  query.id = found->first;
  query.type = found->second.type;
  query.minimum = found->second.minimum;
  query.maximum = found->second.maximum;
  std::memset(query.name, 0, sizeof(query.name));
  put(query.name, found->second.title);
  return 0;
}

int FakeCamera::get_control(v4l2_control& control) {
  const auto found = controls.find(control.id);
  if (found == controls.end()) return EINVAL;
  control.value = found->second.value;
  return 0;
}

int FakeCamera::set_control(const v4l2_control& control) {
  const auto found = controls.find(control.id);
  if (found == controls.end()) return EINVAL;
  if (found->second.refuses != 0) return found->second.refuses;
  found->second.value = control.value;
  if (found->second.written) found->second.written(control.value);
  return 0;
}

int FakeCamera::answer(unsigned long request, void* argument) {
  const auto by = [&]<class Asked>(int (FakeCamera::*method)(Asked&)) {
    return [=, this] { return (this->*method)(*static_cast<Asked*>(argument)); };
  };
  const std::map<unsigned long, std::function<int()>> answers{
      {VIDIOC_QUERYCAP, by(&FakeCamera::capability)},
      {VIDIOC_ENUM_FMT, by(&FakeCamera::enumerate_formats)},
      {VIDIOC_ENUM_FRAMESIZES, by(&FakeCamera::enumerate_sizes)},
      {VIDIOC_ENUM_FRAMEINTERVALS, by(&FakeCamera::enumerate_rates)},
      {VIDIOC_S_FMT, by(&FakeCamera::set_format)},
      {VIDIOC_S_PARM, by(&FakeCamera::set_rate)},
      {VIDIOC_REQBUFS, by(&FakeCamera::request_buffers)},
      {VIDIOC_QUERYBUF, by(&FakeCamera::query_buffer)},
      {VIDIOC_QBUF, by(&FakeCamera::queue)},
      {VIDIOC_DQBUF, by(&FakeCamera::dequeue)},
      {VIDIOC_STREAMON, [&] { return streaming = true, 0; }},
      {VIDIOC_STREAMOFF, [&] { return streaming = false, queued_.clear(), 0; }},
      {VIDIOC_QUERYCTRL, by(&FakeCamera::query_control)},
      {VIDIOC_G_CTRL, by(&FakeCamera::get_control)},
      {VIDIOC_S_CTRL, by(&FakeCamera::set_control)}};
  const auto found = answers.find(request);
  return found == answers.end() ? ENOTTY : found->second();
}

int FakeCamera::ioctl(unsigned long request, void* argument) {
  calls.push_back(request);
  int code = 0;
  if (const auto failing = fails.find(request); failing != fails.end()) {
    const auto times = fails_times.find(request);
    if (times == fails_times.end() || times->second-- > 0) code = failing->second;
  }
  if (code == 0) code = answer(request, argument);
  if (code == 0) return 0;
  errno = code;
  return -1;
}

void* FakeCamera::map(std::size_t length, off_t offset) {
  const std::size_t index = static_cast<std::size_t>(offset) / kBufferBytes;
  if (map_fails != 0 || index >= memory_.size() || length > kBufferBytes) {
    errno = map_fails != 0 ? map_fails : EINVAL;
    return MAP_FAILED;
  }
  ++mapped_count;
  return memory_[index].data();
}

int FakeCamera::poll(int timeout_ms) {
  if (!frames.empty()) return 1;
  if (polled) polled();
  std::this_thread::sleep_for(std::chrono::milliseconds(std::min(timeout_ms, 5)));
  return 0;
}

detail::VideoSystem fake_system(const std::vector<FakeCamera*>& cameras) {
  const auto at = [cameras](int fd) { return cameras.at(static_cast<std::size_t>(fd - kFirstFd)); };
  const auto named = [cameras](const std::string& path) {
    const auto found =
        std::find_if(cameras.begin(), cameras.end(), [&](auto* camera) { return camera->path == path; });
    return found == cameras.end() ? -1 : static_cast<int>(found - cameras.begin());
  };
  detail::VideoSystem system;
  system.open = [at, named](const char* path, int) {
    const int index = named(path);
    if (index < 0) errno = ENOENT;
    return index < 0 || at(kFirstFd + index)->open() != 0 ? -1 : kFirstFd + index;
  };
  system.close = [at](int fd) { return --at(fd)->open_count, 0; };
  system.ioctl = [at](int fd, unsigned long request, void* argument) {
    return at(fd)->ioctl(request, argument);
  };
  system.map = [at](std::size_t length, int fd, off_t offset) { return at(fd)->map(length, offset); };
  system.unmap = [cameras](void*, std::size_t) {  // only one of them streams in a test
    for (FakeCamera* camera : cameras) {
      if (camera->mapped_count > 0) return --camera->mapped_count, 0;
    }
    return -1;
  };
  system.poll = [at](pollfd* fds, nfds_t, int timeout_ms) { return at(fds->fd)->poll(timeout_ms); };
  system.now = [cameras, began = std::chrono::steady_clock::now()] {
    const std::optional<double> now_s = cameras.front()->now_s;
    return now_s ? began + std::chrono::microseconds(std::llround(1e6 * *now_s))
                 : std::chrono::steady_clock::now();
  };
  system.unix_offset_us = [cameras] { return cameras.front()->unix_offset_us; };
  system.nodes = [cameras] {
    std::vector<std::string> paths;
    for (const FakeCamera* camera : cameras) paths.push_back(camera->path);
    return paths;
  };
  system.group = [at, named](const std::string& path) { return at(kFirstFd + named(path))->group; };
  system.held_by = [at, named](const std::string& path) { return at(kFirstFd + named(path))->holder; };
  return system;
}

}  // namespace gelslam::test
