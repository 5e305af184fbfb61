#include "gelslam/slam/line_feed.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>

#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kQueuedFrames = 256;  // Ten seconds at 25 Hz.
// Keyframe lines that are sent at once before frames are sent again.
constexpr std::size_t kBytesOfKeyframes = 1 << 20;

/// Returns about 1000 contact points on a regular grid of pixels, in meters rounded to 0.01 mm.
Json contact_points(const Surface& surface) {
  constexpr double kPoints = 1000.0;
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(surface.contact_pixels / kPoints))));
  const auto rounded = [](double mm) { return std::round(1e2 * mm) / 1e5; };
  Json points = Json::array();
  for (int v = 0; v < surface.contact.rows; v += step)
    for (int u = 0; u < surface.contact.cols; u += step)
      if (surface.contact(v, u) != 0) {
        const Eigen::Vector3d p = surface.point_mm({u, v});
        points.push_back({rounded(p.x()), rounded(p.y()), rounded(p.z())});
      }
  return points;
}

std::string keyframe_line(const MapSnapshot::Node& node, int scan) {
  const Json line = {{"type", "keyframe"},        {"scan", scan},
                     {"keyframe", node.keyframe}, {"frame", node.frame},
                     {"trial", node.trial},       {"points", contact_points(*node.surface.get())}};
  return line.dump() + "\n";
}

/// Returns the map as a line. It contains only keyframes that moved since `before`, the map that the reader
/// has (may be null).
std::string map_line(const MapSnapshot& map, const MapSnapshot* before, int scan) {
  Json keyframes = Json::array();
  for (const MapSnapshot::Node& node : map.nodes) {
    const MapSnapshot::Node* known = before != nullptr ? before->find(node.keyframe) : nullptr;
    if (known != nullptr && known->component == node.component &&
        known->component_T_keyframe.matrix() == node.component_T_keyframe.matrix())
      continue;
    keyframes.push_back({{"keyframe", node.keyframe},
                         {"component", node.component},
                         {"map_pose", row_major_meters(node.component_T_keyframe)}});
  }
  const Json line = {{"type", "map"},
                     {"scan", scan},
                     {"version", map.version},
                     {"shown_component", map.shown_component},
                     {"keyframes", std::move(keyframes)}};
  return line.dump() + "\n";
}

std::string image_line(Json line, const cv::Mat3b& image) {
  const std::vector<std::uint8_t> jpeg = encode_jpeg(image);
  line["jpeg"] = base64({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()});
  return line.dump() + "\n";
}

std::string dropped_line(bool tum, std::uint64_t lines) {
  if (tum) return "# " + std::to_string(lines) + " lines dropped\n";
  return Json{{"type", "dropped"}, {"lines", lines}}.dump() + "\n";
}

}  // namespace

std::shared_ptr<LineFeed::Reader> LineFeed::open(const StreamOptions& options) {
  return std::make_shared<Reader>(*this, options);
}

void LineFeed::write(const FrameReport& report) {
  std::unique_lock lock(mutex_);
  if (readers_.empty()) return;
  const int scan = scan_;
  const std::shared_ptr<const MapSnapshot> map = map_;
  lock.unlock();  // readers may come and go meanwhile
  auto lines = std::make_shared<Lines>();
  lines->ndjson = ndjson_line(report, scan);
  const TrackedFrame& frame = report.tracked;
  const MapPlace* place = report.known_place();
  if (place != nullptr && (!map || map->nodes.empty() || place->component == map->nodes.front().component))
    lines->tum = tum_line(report);
  if (!report.image.empty()) {
    Json line = {{"type", "image"}, {"frame", frame.frame}, {"time_s", frame.time_s}};
    line["time_unix_s"] = unix_s(frame.unix_us);
    line["scan"] = scan;
    lines->image = std::async(std::launch::deferred, image_line, std::move(line), report.image).share();
  }
  lock.lock();
  lines->number = written_++;
  for (Reader* reader : readers_) reader->queue_.push_newest(lines);
}

void LineFeed::set_map(std::shared_ptr<const MapSnapshot> map) {
  const std::lock_guard lock(mutex_);
  map_ = std::move(map);
  for (Reader* reader : readers_)
    if (reader->options_.surface && reader->queue_.size() < kQueuedFrames)
      reader->queue_.push_newest(nullptr);
}

void LineFeed::start_scan() {
  const std::lock_guard lock(mutex_);
  ++scan_;
  map_ = nullptr;
}

void LineFeed::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (Reader* reader : readers_) reader->queue_.close();
}

LineFeed::Reader::Reader(LineFeed& feed, const StreamOptions& options)
    : feed_(feed), options_(options), queue_(kQueuedFrames) {
  const std::lock_guard lock(feed_.mutex_);
  next_number_ = feed_.written_;
  if (feed_.closed_) queue_.close();
  feed_.readers_.insert(this);
}

LineFeed::Reader::~Reader() {
  const std::lock_guard lock(feed_.mutex_);
  feed_.readers_.erase(this);
}

std::optional<std::string> LineFeed::Reader::next(std::chrono::steady_clock::time_point until) {
  if (options_.surface && !options_.tum)
    if (std::string lines = lines_of_map(); !lines.empty()) return lines;
  if (!queue_.wait_until(until)) return std::nullopt;
  const auto frame = queue_.try_pop();
  return frame && *frame ? lines_of(**frame) : "";
}

std::string LineFeed::Reader::lines_of(const Lines& frame) {
  const std::uint64_t lost = frame.number - std::exchange(next_number_, frame.number + 1);
  std::string lines = lost > 0 ? dropped_line(options_.tum, lost) : "";
  lines += options_.tum ? frame.tum : frame.ndjson;
  if (options_.images && !options_.tum && frame.image.valid()) lines += frame.image.get();
  return lines;
}

/// Returns lines for keyframes that were not sent yet, and then for the map that refers to them; "" if the
/// newest map was sent.
std::string LineFeed::Reader::lines_of_map() {
  std::shared_ptr<const MapSnapshot> map;
  int scan = 0;
  {
    const std::lock_guard lock(feed_.mutex_);
    map = feed_.map_;
    scan = feed_.scan_;
  }
  if (scan != std::exchange(scan_, scan)) newest_keyframe_ = -1, sent_ = nullptr;
  if (!map || map == sent_) return "";
  std::string lines;
  for (const MapSnapshot::Node& node : map->nodes) {
    if (node.keyframe <= newest_keyframe_) continue;
    newest_keyframe_ = node.keyframe;
    if (node.surface) lines += keyframe_line(node, scan);
    if (lines.size() > kBytesOfKeyframes) return lines;
  }
  const auto before = std::exchange(sent_, map);
  return lines + map_line(*map, before.get(), scan);
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kTimeToFinish = std::chrono::seconds(1);
constexpr int kLookAgainMs = 50;

}  // namespace

LineOutput::LineOutput(LineFeed& feed, const StreamOptions& options)
    : feed_(feed), thread_([this, reader = feed.open(options)] { run(*reader); }) {}

void LineOutput::run(LineFeed::Reader& lines) {
  sigset_t broken_pipe;  // A write to a pipe without a reader must not end the program.
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  ::pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
  while (const auto text = lines.next(Clock::now() + std::chrono::seconds(1)))
    if (!write(*text)) return;
}

/// Returns false when the pipe has no reader any more, or when the time to finish is over.
bool LineOutput::write(const std::string& lines) {
  for (std::size_t done = 0; done < lines.size();) {
    pollfd out{STDOUT_FILENO, POLLOUT, 0};
    ::poll(&out, 1, kLookAgainMs);
    if (ending_ && Clock::now() > end_at_) return false;
    if ((out.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return false;
    if ((out.revents & POLLOUT) == 0) continue;
    // A pipe that is ready accepts this many bytes without blocking.
    const ssize_t count =
        ::write(STDOUT_FILENO, lines.data() + done, std::min<std::size_t>(lines.size() - done, PIPE_BUF));
    if (count < 0 && errno != EAGAIN && errno != EINTR) {
      failed_ = errno != EPIPE;
      return false;
    }
    if (count > 0) done += static_cast<std::size_t>(count);
  }
  return true;
}

bool LineOutput::finish() {
  if (thread_.joinable()) {
    end_at_ = Clock::now() + kTimeToFinish;
    ending_ = true;
    feed_.close();
    thread_.join();
  }
  return !failed_;
}

}  // namespace gelslam
