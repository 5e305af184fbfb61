#include "logs/matroska_file.hpp"

extern "C" {
#include <libavcodec/packet.h>
#include <libavformat/avformat.h>
}

#include <cmath>
#include <span>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "images/crop.hpp"
#include "images/video_file.hpp"
#include "logs/matroska_header.hpp"

namespace gelslam::detail {
namespace {

std::string tag_of(const AVDictionary* tags, const char* name) {
  const AVDictionaryEntry* entry = av_dict_get(tags, name, nullptr, 0);
  return entry == nullptr ? "" : std::string(entry->value).substr(0, kLargestTextBytes);
}

std::optional<FrameEncoding> encoding_of(const AVCodecParameters& codec) {
  if (codec.codec_id == AV_CODEC_ID_MJPEG) return FrameEncoding::jpeg;
  if (codec.codec_id == AV_CODEC_ID_PNG) return FrameEncoding::png;
  if (codec.codec_id == AV_CODEC_ID_RAWVIDEO && codec.codec_tag == MKTAG('Y', 'U', 'Y', '2'))
    return FrameEncoding::yuyv;
  return std::nullopt;
}

/// LogWriter's own note; a tool that cuts a log copies it, right or wrong.
double noted_frames(const AVFormatContext& file, const MatroskaFile::Video& video) {
  return video.ours ? std::atof(tag_of(file.metadata, kFramesTag).c_str())
                    : std::round(video.duration_s * video.rate_hz);
}

std::optional<std::int64_t> sequence_of(const AVPacket& packet) {
  std::size_t size = 0;
  const std::uint8_t* data = av_packet_get_side_data(&packet, AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL, &size);
  if (data == nullptr || size != 16) return std::nullopt;  // eight bytes of id before ours
  std::uint64_t sequence = 0;
  for (std::size_t i = 8; i < 16; ++i) sequence = sequence << 8 | data[i];
  constexpr std::uint64_t most = std::uint64_t{1} << 53;
  return sequence < most ? std::optional(static_cast<std::int64_t>(sequence)) : std::nullopt;
}

}  // namespace

struct MatroskaFile::Av {
  AVFormatContext* file = nullptr;
  AVPacket* packet = av_packet_alloc();
  int stream = -1;
  Av() = default;
  Av(const Av&) = delete;
  Av& operator=(const Av&) = delete;
  ~Av() {
    av_packet_free(&packet);
    avformat_close_input(&file);
  }
};

MatroskaFile::MatroskaFile(const std::filesystem::path& path) : path_(path), av_(std::make_unique<Av>()) {
  av_->file = open_container(path, "matroska");
  if (av_->file == nullptr)
    throw Error(path.string() + ": not a Matroska file that can be read (or damaged from the start)");
  av_->file->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;  // bytes and times as they are
  find_video();
}

MatroskaFile::~MatroskaFile() = default;

void MatroskaFile::find_video() {
  const std::span streams(av_->file->streams, av_->file->nb_streams);
  for (AVStream* stream : streams) {
    const bool is_video = stream->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
                          (stream->disposition & AV_DISPOSITION_ATTACHED_PIC) == 0;
    if (!is_video || av_->stream >= 0) {
      stream->discard = AVDISCARD_ALL;
      continue;
    }
    av_->stream = stream->index;
    video_.encoding = encoding_of(*stream->codecpar);
    video_.width_px = stream->codecpar->width;
    video_.height_px = stream->codecpar->height;
    const double rate_hz = av_q2d(stream->avg_frame_rate);
    if (std::isfinite(rate_hz) && rate_hz >= 0.01 && rate_hz <= 10000.0) video_.rate_hz = rate_hz;
  }
  if (av_->stream < 0) throw Error(path_.string() + ": holds no video");
  check_picture_size(path_, video_.width_px, video_.height_px);
  video_.ours = tag_of(av_->file->metadata, "encoder") == kLogApplication;
  if (av_->file->duration > 0) video_.duration_s = static_cast<double>(av_->file->duration) / AV_TIME_BASE;
  video_.frames = plausible_frames(noted_frames(*av_->file, video_));
}

std::optional<MatroskaFile::Packet> MatroskaFile::next() {
  for (;; av_packet_unref(av_->packet)) {
    if (av_read_frame(av_->file, av_->packet) < 0) return std::nullopt;
    const AVPacket& packet = *av_->packet;
    if (packet.stream_index != av_->stream || packet.size <= 0 || (packet.flags & AV_PKT_FLAG_CORRUPT) != 0)
      continue;
    Packet result;
    result.bytes.assign(packet.data, packet.data + packet.size);
    // A track that is described as in AVI files (PNG) has its times as those of decoding.
    const std::int64_t ticks = packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts;
    if (ticks != AV_NOPTS_VALUE)
      result.time_us =
          av_rescale_q(ticks, av_->file->streams[av_->stream]->time_base, AVRational{1, 1'000'000});
    result.sequence = sequence_of(packet);
    av_packet_unref(av_->packet);
    return result;
  }
}

LogAttachments MatroskaFile::attachments() const {
  LogAttachments found;
  found.sensor = tag_of(av_->file->metadata, kSensorTag);
  found.camera_settings = tag_of(av_->file->metadata, kSettingsTag);
  for (const AVStream* stream : std::span(av_->file->streams, av_->file->nb_streams)) {
    if (stream->codecpar->codec_type != AVMEDIA_TYPE_ATTACHMENT || stream->codecpar->extradata_size <= 0)
      continue;
    const std::string name = tag_of(stream->metadata, "filename");
    const bool config = name == kConfigAttachment, model = name == kModelAttachment;
    if (!config && !model) continue;
    const std::string_view data(reinterpret_cast<const char*>(stream->codecpar->extradata),
                                static_cast<std::size_t>(stream->codecpar->extradata_size));
    if (data.size() > (config ? kLargestConfigBytes : kLargestModelBytes))
      throw Error(path_.string() + ": its attachment " + name + " is too large to be one");
    (config ? found.config_yaml : found.model) = data;
  }
  return found;
}

}  // namespace gelslam::detail
