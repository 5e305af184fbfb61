#include <fmt/core.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <tuple>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

using namespace detail;

using Clock = std::chrono::steady_clock;
constexpr int kWaitSliceMs = 100;  // stop() takes effect within this time.
constexpr auto kRetryPause = std::chrono::milliseconds(50), kReturnPause = std::chrono::milliseconds(200);
constexpr auto kOldest = std::chrono::seconds(1);  // A frame with a longer age has a wrong time stamp.
constexpr double kFasterThanNamed = 1.1;  // A camera may be faster than its nominal rate by this factor.
// A smaller change may come from a clock that is being adjusted slowly.
constexpr std::int64_t kClockStepUs = 100'000;

constexpr std::uint32_t kBuffersAsked = 4;  // Enough for a delay of 160 ms at 25 Hz.
constexpr auto kPauseWhenNotReady = std::chrono::milliseconds(5);

v4l2_buffer empty_buffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

/// On Linux, steady_clock is the monotonic clock of the driver.
std::optional<Clock::time_point> monotonic_time(const v4l2_buffer& buffer) {
  const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  const bool given = buffer.timestamp.tv_sec != 0 || buffer.timestamp.tv_usec != 0;
  if (!monotonic || !given) return std::nullopt;
  using namespace std::chrono;
  return Clock::time_point(seconds(buffer.timestamp.tv_sec) + microseconds(buffer.timestamp.tv_usec));
}

/// A frame as it comes from the driver's queue.
struct CapturedFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  /// Time stamp of the driver on the monotonic clock; nothing if it uses another clock.
  std::optional<Clock::time_point> captured;
  Clock::time_point arrived;
};

enum class Capture { frame, nothing_yet, damaged };

/// The driver's buffers, mapped and streaming during the lifetime of this object.
class CaptureStream {
 public:
  /// Throws Error when the driver gives no buffers or does not start.
  explicit CaptureStream(const VideoNode& node) : node_(node) {
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

  ~CaptureStream() {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    node_.call(VIDIOC_STREAMOFF, &type);
    unmap_buffers();
  }

  CaptureStream(const CaptureStream&) = delete;
  CaptureStream& operator=(const CaptureStream&) = delete;

  /// Waits up to `wait_ms` for a frame. `damaged` means marked so by the driver, or empty. Throws
  /// CameraFailure when the camera is gone.
  Capture take(int wait_ms, CapturedFrame& frame) {
    pollfd waiting{node_.fd(), POLLIN, 0};
    const int ready = node_.system().poll(&waiting, 1, wait_ms);
    if (ready == 0) return Capture::nothing_yet;
    if (ready < 0 && errno != EINTR) throw node_.failure("wait for a frame", errno);
    // The queue decides, whatever poll() says: for an unplugged camera this call returns ENODEV.
    v4l2_buffer buffer = empty_buffer(0);
    if (const int code = node_.call(VIDIOC_DQBUF, &buffer); code != 0) {
      if (code != EAGAIN) throw node_.failure("get a frame", code);
      std::this_thread::sleep_for(kPauseWhenNotReady);
      return Capture::nothing_yet;
    }
    frame.arrived = node_.system().now();
    if (buffer.index >= buffers_.size()) throw node_.failure("get a frame", EIO);
    const auto& memory = buffers_[buffer.index];
    const bool usable = (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused > 0 &&
                        buffer.bytesused <= memory.size();
    if (usable) frame.bytes.assign(memory.begin(), memory.begin() + buffer.bytesused);
    frame.sequence = buffer.sequence;
    frame.captured = monotonic_time(buffer);
    queue(buffer.index);
    return usable ? Capture::frame : Capture::damaged;
  }

 private:
  void map_buffers() {
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
      if (address == MAP_FAILED) throw node_.failure("map its buffers", errno);
      buffers_.emplace_back(static_cast<std::uint8_t*>(address), buffer.length);
    }
  }

  void unmap_buffers() {
    for (const auto& buffer : buffers_) node_.system().unmap(buffer.data(), buffer.size());
    v4l2_requestbuffers none{};
    none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    none.memory = V4L2_MEMORY_MMAP;
    // Frees the buffers, so that the next program to open the camera gets its own.
    node_.call(VIDIOC_REQBUFS, &none);
    buffers_.clear();
  }

  void queue(std::uint32_t index) {
    v4l2_buffer buffer = empty_buffer(index);
    node_.require(VIDIOC_QBUF, &buffer, "queue a buffer");
  }

  const VideoNode& node_;
  std::vector<std::span<std::uint8_t>> buffers_;
};

void give_up_if_asked(const CameraOptions& options) {
  if (options.gives_up && options.gives_up())
    throw Error("stopped while the camera was being opened; nothing was written");
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

CameraInfo capture_identity(const VideoNode& node) {
  CameraInfo identity = node.identity();
  if (identity.node == CameraNode::capture) return identity;
  if (identity.node == CameraNode::metadata) {
    const std::string beside = capture_node_beside(node.path(), identity.bus, node.system());
    throw Error(node.path() + ": carries only metadata of " + identity.name +
                (beside.empty() ? "; see gelslam devices" : "; its pictures are at " + beside));
  }
  // A virtual camera becomes a capture node when a program feeds it, so this problem may pass.
  throw CameraFailure(node.path() + ": gives no pictures (" + identity.name + " is no camera now)", EAGAIN);
}

/// A streaming camera, as long as it is connected.
struct OpenCamera {
  /// `as_before` are the settings of the first opening; if null, they are read after the automatic controls
  /// have settled.
  OpenCamera(const CameraOptions& options, const std::string& path, const VideoSystem& system,
             const std::vector<CameraSetting>* as_before)
      : node(system, path),
        identity(capture_identity(node)),
        format(negotiate_format(node, options)),
        stream(node) {
    if (as_before == nullptr && has_automatics_on(node)) settle(options);
    controls = hold_controls(node, options.controls, as_before ? *as_before : read_controls(node));
  }

  /// Lets automatic exposure and white balance settle; their values are then locked. The frames received
  /// meanwhile are dropped.
  void settle(const CameraOptions& options) {
    const Clock::time_point start = Clock::now();
    CapturedFrame ignored;
    while (seconds_since(start) < options.settle_s) {
      stream.take(kWaitSliceMs, ignored);
      give_up_if_asked(options);
    }
  }

  VideoNode node;
  CameraInfo identity;
  CaptureFormat format;
  CaptureStream stream;
  ControlReport controls;
};

class V4l2Camera final : public CameraSource {
 public:
  V4l2Camera(const CameraOptions& options, const std::string& path, const VideoSystem& system)
      : options_(options),
        system_(system),
        open_(std::make_unique<OpenCamera>(options, path, system, nullptr)),
        identity_(open_->identity),
        format_(open_->format),
        settings_(open_->controls.settings),
        path_(path) {
    for (const std::string& warning : {wrong_sensor_warning(), format_.warning, open_->controls.warning})
      append_sentence(opening_warning_, warning);
    if (!opening_warning_.empty()) opening_warning_ = path + ": " + opening_warning_;
    // The object that it refers to may not exist any more when frames are read.
    options_.gives_up = nullptr;
  }

  std::optional<RawFrame> next() override {
    while (!stopped_) {
      try {
        if (!open_) open_again();
        return next_of_open();
      } catch (const Error& error) {
        if (options_.reconnect_timeout_s <= 0 || delivered_ == 0) throw;
        wait_for_return(error);
      }
    }
    return std::nullopt;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return format_.rate_hz; }
  std::int64_t lost_frames() const override { return lost_; }
  const std::vector<CameraSetting>& settings() const override { return settings_; }
  std::string disconnect_reason() const override {
    return is_away_ && !stopped_ ? fmt::format("connect it again within {:g} s", options_.reconnect_timeout_s)
                                 : "";
  }

  std::string description() const override {
    return fmt::format("{}, {}, {} {}, {:g} Hz", identity_.name, path_,
                       options_.encoding == FrameEncoding::jpeg ? "MJPG" : "YUYV",
                       size_text(options_.width_px, options_.height_px),
                       std::round(format_.rate_hz * 100) / 100);
  }

  std::string warning() const override {
    const int damaged = damaged_;
    std::string text = opening_warning_;
    if (damaged > 0)
      append_sentence(text, path_ + ": " + counted(damaged, "frame") +
                                " came damaged from the driver; check cable and port");
    if (disconnected_s_ > 0)
      append_sentence(text, fmt::format("the camera was away for {:.1f} s", disconnected_s_.load()));
    if (clock_step_us_ != 0)
      append_sentence(text, fmt::format("the system's clock was set by {:.1f} s; times go on as they began",
                                        1e-6 * static_cast<double>(clock_step_us_)));
    return text;
  }

 private:
  std::optional<RawFrame> next_of_open() {
    const Clock::time_point start = Clock::now();
    int damaged_here = 0;
    while (!stopped_) {
      const Capture capture = open_->stream.take(kWaitSliceMs, captured_);
      if (capture == Capture::frame && !is_short()) return deliver();
      if (capture != Capture::nothing_yet) {
        ++damaged_;
        ++damaged_here;
      }
      if (seconds_since(start) > options_.timeout_s) throw Error(stall_words(damaged_here));
    }
    return std::nullopt;
  }

  /// Handles a camera that is lost temporarily. It is closed, so that it can get the same node again. Throws
  /// Error when it is away for too long.
  void wait_for_return(const Error& error) {
    open_.reset();
    if (!is_away_.exchange(true)) {
      why_away_ = error.what();
      others_ = nodes_named(identity_.name, system_);
    }
    if (seconds_since(last_arrival_) > options_.reconnect_timeout_s) {
      stopped_ = true;
      throw Error(fmt::format("{} (waited {:g} s for it)", why_away_, options_.reconnect_timeout_s));
    }
    std::this_thread::sleep_for(kReturnPause);
  }

  void open_again() {
    open_ =
        std::make_unique<OpenCamera>(options_, find_again(identity_, others_, system_), system_, &settings_);
  }

  std::string wrong_sensor_warning() const {
    const std::string is = known_sensor(identity_.name), wanted = known_sensor(options_.sensor);
    if (is.empty() || wanted.empty() || is == wanted) return "";
    return "this is a " + is + ", the configuration is for a " + wanted;
  }

  std::string stall_words(int damaged_here) const {
    return fmt::format(
        "{}: no {}frame for {:g} s{}; unplug the camera and plug it in again, directly and into another port "
        "if this "
        "comes back",
        open_->node.path(), damaged_here > 0 ? "whole " : "", options_.timeout_s,
        damaged_here > 0 ? fmt::format(" ({} damaged ones)", damaged_here) : "");
  }

  /// In an uncompressed image that ends early, the missing rows would be those of the previous image.
  bool is_short() const {
    const std::size_t rows = static_cast<std::size_t>(options_.height_px);
    return open_->format.row_bytes > 0 &&
           captured_.bytes.size() < open_->format.row_bytes * (rows - 1) + row_length();
  }
  std::size_t row_length() const { return 2 * static_cast<std::size_t>(options_.width_px); }

  void close_row_gaps() {
    if (open_->format.row_bytes <= row_length()) return;
    std::vector<std::uint8_t>& bytes = captured_.bytes;
    for (std::size_t row = 1; row < static_cast<std::size_t>(options_.height_px); ++row) {
      const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(row * open_->format.row_bytes);
      std::copy(from, from + static_cast<std::ptrdiff_t>(row_length()),
                bytes.begin() + static_cast<std::ptrdiff_t>(row * row_length()));
    }
    bytes.resize(row_length() * static_cast<std::size_t>(options_.height_px));
  }

  /// Returns the increase of the driver's frame counter, which starts again when the camera is reconnected.
  std::uint32_t sequence_step() {
    if (is_away_)
      return std::max(1u, static_cast<std::uint32_t>(std::lround(disconnected_s_now() * format_.rate_hz)));
    return delivered_ == 0 ? 1 : captured_.sequence - last_sequence_;
  }
  double disconnected_s_now() const {
    return std::chrono::duration<double>(captured_.arrived - last_arrival_).count();
  }

  RawFrame deliver() {
    close_row_gaps();
    const std::uint32_t step = sequence_step();
    const double time_s = time_of_frame();
    // Otherwise the driver has restarted its counter, does not count, or the number is larger than possible.
    const bool plausible =
        step >= 1 && static_cast<double>(delivered_ + lost_ + step) <=
                         1 + 2 * kBuffersAsked + kFasterThanNamed * format_.rate_hz * time_s;
    if (plausible) lost_ += step - 1;
    sequence_ += delivered_ == 0 ? captured_.sequence : (plausible ? step : 1);
    last_sequence_ = captured_.sequence;

    RawFrame frame;
    if (is_away_.exchange(false)) {
      disconnected_s_ += disconnected_s_now();
      ++reconnects_;
    }
    frame.reconnects = reconnects_;
    frame.encoding = options_.encoding;
    frame.bytes = std::move(captured_.bytes);
    frame.width_px = options_.width_px;
    frame.height_px = options_.height_px;
    frame.arrived = captured_.arrived;
    frame.age = captured_.arrived - captured_.captured.value_or(captured_.arrived);
    if (frame.age < frame.age.zero() || frame.age > kOldest) frame.age = frame.age.zero();
    frame.time_s = time_s;
    follow_clock(frame.arrived - frame.age);
    frame.unix_us = unix_us_of(start_unix_us_, frame.time_s);
    frame.index = delivered_++;
    frame.sequence = sequence_;
    last_arrival_ = frame.arrived;
    return frame;
  }

  /// The offset of the system's clock is read once. Otherwise, setting the clock during a recording would
  /// cause a jump of the times.
  void follow_clock(Clock::time_point captured) {
    const std::int64_t offset_us = system_.unix_offset_us();
    if (delivered_ == 0)
      start_unix_us_ = offset_us + microseconds_of(captured.time_since_epoch());
    else if (std::abs(offset_us - last_offset_us_) > kClockStepUs)
      clock_step_us_ += offset_us - last_offset_us_;
    last_offset_us_ = offset_us;
  }

  /// Returns the time of a frame by the driver's clock if its time stamps increase and are not later than the
  /// arrival; otherwise by the arrival. A wrong time stamp does not affect later times.
  double time_of_frame() {
    const auto& [stamp, arrived] = std::tie(captured_.captured, captured_.arrived);
    Clock::time_point time = stamp ? *stamp + stamp_offset_ : arrived;
    const bool doubtful = delivered_ == 0 || time <= last_time_ || time > arrived + kOldest;
    if (doubtful) time = arrived;
    // Two doubtful stamps in a row mean that the clock was changed.
    if (doubtful && stamps_doubtful_ && stamp) stamp_offset_ = time - *stamp;
    stamps_doubtful_ = doubtful;
    if (delivered_ == 0) first_time_ = last_time_ = time;
    last_time_ = std::max(time, last_time_);
    return std::chrono::duration<double>(last_time_ - first_time_).count();
  }

  CameraOptions options_;
  const VideoSystem& system_;
  std::unique_ptr<OpenCamera> open_;  // Null while the camera is disconnected.
  // Properties at the first opening.
  const CameraInfo identity_;
  const CaptureFormat format_;
  const std::vector<CameraSetting> settings_;
  const std::string path_;
  std::string opening_warning_, why_away_;
  std::vector<std::string> others_;         // Cameras of the same name that were present when it was lost.
  std::atomic<bool> is_away_ = false;       // True until a frame arrives again.
  std::atomic<double> disconnected_s_ = 0;  // Total time of all interruptions.
  int reconnects_ = 0;

  CapturedFrame captured_;
  std::int64_t delivered_ = 0, sequence_ = 0;
  std::uint32_t last_sequence_ = 0;
  Clock::time_point last_arrival_, first_time_, last_time_;
  // Offset of the driver's clock, which may be another clock or may be set.
  Clock::duration stamp_offset_{};
  bool stamps_doubtful_ = true;
  std::int64_t start_unix_us_ = 0, last_offset_us_ = 0;
  std::atomic<std::int64_t> clock_step_us_ = 0;
  std::atomic<std::int64_t> lost_ = 0;
  std::atomic<int> damaged_ = 0;
  std::atomic<bool> stopped_ = false;
};

/// Says whether the failure may be temporary: a camera that another program has just closed, or a virtual one
/// that is just starting, reports such errors for a moment.
bool may_pass(const CameraFailure& failure) {
  return failure.code == EBUSY || failure.code == EINVAL || failure.code == EAGAIN;
}

}  // namespace

std::unique_ptr<CameraSource> open_camera(const CameraOptions& options, const detail::VideoSystem& system) {
  const std::string path = find_camera(options, system);
  for (const Clock::time_point start = Clock::now();;) {
    give_up_if_asked(options);
    try {
      auto camera = std::make_unique<V4l2Camera>(options, path, system);
      give_up_if_asked(options);  // Checked once more before success.
      return camera;
    } catch (const CameraFailure& failure) {
      if (!may_pass(failure) || seconds_since(start) > options.patience_s) throw;
    }
    std::this_thread::sleep_for(kRetryPause);
  }
}

}  // namespace gelslam
