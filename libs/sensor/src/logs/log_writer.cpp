#include "gelslam/sensor/log_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/encoders.hpp"
#include "logs/appended_file.hpp"
#include "logs/matroska_header.hpp"

namespace gelslam {
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
  return static_cast<std::uint64_t>(std::llround(std::clamp(time_s, 0.0, most_s) * (1e9 / matroska_tick_ns)));
}

void refuse_over(std::size_t size, std::size_t largest, const char* what) {
  if (size > largest)
    throw Error(std::string("the log cannot hold ") + what + ": larger than " + std::to_string(largest) +
                " bytes");
}

std::int64_t unix_now_s() {
  using namespace std::chrono;
  return duration_cast<seconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace

struct LogWriter::Impl {
  Impl(const std::filesystem::path& log_path, LogAttachments log_attachments, double log_rate_hz)
      : path(log_path),
        attachments(std::move(log_attachments)),
        rate_hz(log_rate_hz > 0.01 && log_rate_hz < 1e5 ? log_rate_hz : 25.0) {
    refuse_over(attachments.config_yaml.size(), largest_config_bytes, "the configuration");
    refuse_over(attachments.model.size(), largest_model_bytes, "the gradient model");
    refuse_over(attachments.sensor.size() + attachments.camera_settings.size(), largest_text_bytes,
                "the camera's settings");
    file.emplace(path);
  }

  bool fail(const std::string& reason) {
    failure = path.string() + ": recording stopped after " + counted(frames, "frame") +
              (frames == 0 ? ": " : ", still readable: ") + reason;
    return false;
  }

  /// A file without a name goes on growing on the disk, for nobody.
  bool lose() {
    failure = path.string() + ": recording stopped: somebody removed the log, and with it " +
              counted(frames, "frame");
    return false;
  }

  bool begin(const RawFrame& frame) {
    track.encoding = frame.encoding == FrameEncoding::bgr ? FrameEncoding::png : frame.encoding;
    track.width_px = frame.width_px;
    track.height_px = frame.height_px;
    track.rate_hz = rate_hz;
    first_encoding = frame.encoding;
    header = matroska_header(attachments, track, unix_now_s());
    const std::string problem = file->append(header.bytes, "");
    return problem.empty() || fail(problem);
  }

  bool fits(const RawFrame& frame) const {
    return frame.encoding == first_encoding && frame.width_px == track.width_px &&
           frame.height_px == track.height_px;
  }

  bool write(const RawFrame& frame) {
    if (!failure.empty()) return false;
    if (file->removed()) return lose();
    if (frames == 0 && file->size() == 0 && !begin(frame)) return false;
    if (!fits(frame)) return fail("the camera's pictures changed their size or kind");
    const std::uint64_t ticks = ticks_of(frame.time_s);
    const bool encode = frame.encoding == FrameEncoding::bgr;
    const std::vector<std::uint8_t> png = encode ? png_of(frame) : std::vector<std::uint8_t>();
    const std::string_view data = text_of(encode ? png : frame.bytes);
    const std::string problem =
        file->append(cluster_head(ticks, static_cast<std::uint64_t>(frame.sequence), data.size()), data);
    if (!problem.empty()) return fail(problem);
    last_ticks = std::max(last_ticks, ticks);
    ++frames;
    return true;
  }

  void close() {
    if (closed) return;
    closed = true;
    if (file->removed()) {
      if (failure.empty() && frames > 0) lose();
      return;
    }
    if (frames == 0) {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
      return;
    }
    const std::uint64_t frame_ticks =
        static_cast<std::uint64_t>(std::llround(1e9 / matroska_tick_ns / rate_hz));
    std::string problem = file->overwrite(header.duration_at, duration_element(last_ticks + frame_ticks));
    if (problem.empty()) problem = file->overwrite(header.frames_at, frames_element(frames));
    const auto segment_bytes = static_cast<std::uint64_t>(file->size()) - header.segment_begins_at;
    if (problem.empty()) problem = file->overwrite(header.segment_length_at, ebml_length_8(segment_bytes));
    if (problem.empty()) problem = file->sync();
    if (!problem.empty() && failure.empty()) fail(problem);
  }

  std::filesystem::path path;
  LogAttachments attachments;
  double rate_hz;
  std::optional<AppendedFile> file;
  MatroskaTrack track;
  MatroskaHeader header;
  FrameEncoding first_encoding = FrameEncoding::jpeg;
  std::int64_t frames = 0;
  std::uint64_t last_ticks = 0;
  bool closed = false;
  std::string failure;
};

LogWriter::LogWriter(const std::filesystem::path& path, LogAttachments attachments, double rate_hz)
    : impl_(std::make_unique<Impl>(path, std::move(attachments), rate_hz)) {}

LogWriter::~LogWriter() { close(); }

bool LogWriter::write(const RawFrame& frame) { return impl_->write(frame); }
const std::string& LogWriter::failure() const { return impl_->failure; }
void LogWriter::close() { impl_->close(); }
const std::filesystem::path& LogWriter::path() const { return impl_->path; }
std::int64_t LogWriter::frames() const { return impl_->frames; }
std::int64_t LogWriter::bytes() const { return impl_->file->size(); }

}  // namespace gelslam
