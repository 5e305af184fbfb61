#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "logs/matroska_header.hpp"

namespace gelslam {
namespace detail {

/// A file to which only whole blocks are appended: a block that does not fit (full disk, limit of the file
/// size) is removed again. Blocks are passed to the operating system immediately, without a buffer in this
/// program.
class AppendedFile {
 public:
  /// Throws Error when the file exists or cannot be created.
  explicit AppendedFile(const std::filesystem::path& path)
      : file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)) {
    if (file_.ok()) return;
    if (errno == EEXIST) throw Error(path.string() + ": exists already; name another file");
    throw Error(path.string() + ": cannot be created: " + errno_text());
  }

  /// Returns "" or the system's error.
  std::string append(std::string_view bytes) {
    for (std::string_view left = bytes; !left.empty();) {
      const ssize_t written = ::write(file_.get(), left.data(), left.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        const std::string message = written < 0 ? errno_text() : "nothing was taken";
        // If this fails, readers still stop before the incomplete block.
        if (::ftruncate(file_.get(), size_) == 0) ::lseek(file_.get(), size_, SEEK_SET);
        return message;
      }
      left.remove_prefix(static_cast<std::size_t>(written));
    }
    size_ += static_cast<std::int64_t>(bytes.size());
    return "";
  }

  /// Replaces bytes that were written before.
  std::string overwrite(std::size_t at, std::string_view bytes) {
    const ssize_t written = ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (written < 0) return errno_text();
    return static_cast<std::size_t>(written) == bytes.size() ? "" : "not all was taken";
  }

  /// Forces everything to the disk.
  std::string sync() { return ::fsync(file_.get()) == 0 ? "" : errno_text(); }

  /// Says whether the file was removed in the meantime and has no name any more.
  bool removed() const {
    struct stat status {};
    return ::fstat(file_.get(), &status) == 0 && status.st_nlink == 0;
  }

  std::int64_t size() const { return size_; }

 private:
  FileDescriptor file_;
  std::int64_t size_ = 0;
};

}  // namespace detail

namespace {

using namespace detail;

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::uint8_t> png_of(const RawFrame& frame) {
  const auto expected =
      static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px) * 3;
  if (frame.bytes.empty() || frame.bytes.size() != expected)
    throw std::invalid_argument("LogWriter: bgr frame of the wrong size");
  const cv::Mat picture(frame.height_px, frame.width_px, CV_8UC3,
                        const_cast<std::uint8_t*>(frame.bytes.data()));
  return encode_png(picture);
}

std::uint64_t ticks_of(double time_s) {
  constexpr double most_s = 1e9;
  return static_cast<std::uint64_t>(std::llround(std::clamp(time_s, 0.0, most_s) * (1e9 / kMatroskaTickNs)));
}

void refuse_over(std::size_t size, std::size_t largest, const char* what) {
  if (size > largest)
    throw Error(std::string("the log cannot hold ") + what + ": larger than " + std::to_string(largest) +
                " bytes");
}

}  // namespace

struct LogWriter::Impl {
  Impl(const std::filesystem::path& log_path, const LogAttachments& attachments, double frame_rate_hz)
      : path(log_path),
        stored(attachments),
        rate_hz(frame_rate_hz > 0.01 && frame_rate_hz < 1e5 ? frame_rate_hz : 25.0) {
    refuse_over(stored.config_yaml.size(), kLargestConfigBytes, "the configuration");
    refuse_over(stored.model.size(), kLargestModelBytes, "the gradient model");
    refuse_over(stored.sensor.size() + stored.camera_settings.size(), kLargestTextBytes,
                "the camera's settings");
    file.emplace(path);
  }

  bool fail(const std::string& reason) {
    failure = path.string() + ": recording stopped after " + counted(frames, "frame") +
              (frames == 0 ? ": " : ", still readable: ") + reason;
    return false;
  }

  /// A removed file would go on growing on the disk without any use.
  bool fail_removed() {
    failure = path.string() + ": recording stopped: somebody removed the log, and with it " +
              counted(frames, "frame");
    return false;
  }

  /// Creates the file with the first frame.
  bool begin(const RawFrame& frame) {
    format = {frame.encoding, frame.width_px, frame.height_px, rate_hz};
    MatroskaTrack track = *format;
    if (track.encoding == FrameEncoding::bgr) track.encoding = FrameEncoding::png;
    header = matroska_header(stored, track, unix_us_now(), unix_us_of(frame.unix_us, -frame.time_s));
    const std::string problem = file->append(header.bytes);
    return problem.empty() || fail(problem);
  }

  bool fits(const RawFrame& frame) const {
    return frame.encoding == format->encoding && frame.width_px == format->width_px &&
           frame.height_px == format->height_px;
  }

  bool write(const RawFrame& frame) {
    if (!failure.empty()) return false;
    if (file->removed()) return fail_removed();
    if (!format && !begin(frame)) return false;
    if (!fits(frame)) return fail("the camera's pictures changed their size or kind");
    const std::uint64_t ticks = ticks_of(frame.time_s);
    const bool encode = frame.encoding == FrameEncoding::bgr;
    const std::vector<std::uint8_t> png = encode ? png_of(frame) : std::vector<std::uint8_t>();
    const std::string_view data = text_of(encode ? png : frame.bytes);
    cluster.clear();  // The memory is kept.
    cluster += cluster_head(ticks, static_cast<std::uint64_t>(frame.sequence), data.size());
    cluster += data;
    const std::string problem = file->append(cluster);
    if (!problem.empty()) return fail(problem);
    end_ticks = std::max(end_ticks, ticks + ticks_of(1 / rate_hz));
    ++frames;
    return true;
  }

  void close() {
    if (closed) return;
    closed = true;
    if (file->removed()) {
      if (failure.empty() && frames > 0) fail_removed();
      return;
    }
    if (frames == 0) {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
      return;
    }
    std::string problem = file->overwrite(header.duration_at, duration_element(end_ticks));
    if (problem.empty()) problem = file->overwrite(header.frames_at, frames_element(frames));
    const auto segment_bytes = static_cast<std::uint64_t>(file->size()) - header.segment_begins_at;
    if (problem.empty()) problem = file->overwrite(header.segment_length_at, ebml_length_8(segment_bytes));
    if (problem.empty()) problem = file->sync();
    if (!problem.empty() && failure.empty()) fail(problem);
  }

  std::filesystem::path path;
  LogAttachments stored;
  double rate_hz;
  std::optional<MatroskaTrack> format;  // Format of the incoming frames.
  std::optional<AppendedFile> file;
  MatroskaHeader header;
  std::string cluster;  // Cluster of the last frame.
  std::int64_t frames = 0;
  std::uint64_t end_ticks = 0;
  bool closed = false;
  std::string failure;
};

LogWriter::LogWriter(const std::filesystem::path& path, const LogAttachments& attachments, double rate_hz)
    : impl_(std::make_unique<Impl>(path, attachments, rate_hz)) {}

LogWriter::~LogWriter() { close(); }

bool LogWriter::write(const RawFrame& frame) { return impl_->write(frame); }
const std::string& LogWriter::failure() const { return impl_->failure; }
void LogWriter::close() { impl_->close(); }
const std::filesystem::path& LogWriter::path() const { return impl_->path; }
std::int64_t LogWriter::frames() const { return impl_->frames; }
std::int64_t LogWriter::bytes() const { return impl_->file->size(); }

}  // namespace gelslam
