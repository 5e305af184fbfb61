#include "images/video_file.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <mutex>
#include <opencv2/core.hpp>
#include <span>
#include <string_view>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "images/sources.hpp"
#include "logs/matroska_header.hpp"

namespace gelslam::detail {
namespace {

/// Names of libav's readers for files that contain their images.
constexpr const char* kContainers =
    "avi,matroska,webm,mov,mp4,m4a,3gp,3g2,mj2,mpegts,mpeg,mpegvideo,asf,flv,ogg,nut,mxf,ivf,gif,mjpeg,"
    "h264,hevc,yuv4mpegpipe";

/// Silences libav, because errors are reported by this program. libav's log level belongs to the whole
/// process, so it is restored afterwards.
class Quiet {
 public:
  Quiet() {
    const std::lock_guard lock(mutex);
    if (users++ > 0) return;
    before = av_log_get_level();
    av_log_set_level(AV_LOG_QUIET);
  }
  ~Quiet() {
    const std::lock_guard lock(mutex);
    if (--users == 0) av_log_set_level(before);
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  static inline std::mutex mutex;
  static inline int users = 0, before = 0;
};

std::string tag_of(const AVDictionary* tags, const char* name) {
  const AVDictionaryEntry* entry = av_dict_get(tags, name, nullptr, 0);
  return entry == nullptr ? "" : std::string(entry->value).substr(0, kLargestTextBytes);
}

/// Returns bgr for videos that are decoded here.
FrameEncoding encoding_of(const AVCodecParameters& codec) {
  if (codec.codec_id == AV_CODEC_ID_MJPEG) return FrameEncoding::jpeg;
  if (codec.codec_id == AV_CODEC_ID_PNG) return FrameEncoding::png;
  const bool is_yuyv = codec.codec_id == AV_CODEC_ID_RAWVIDEO && codec.codec_tag == MKTAG('Y', 'U', 'Y', '2');
  return is_yuyv ? FrameEncoding::yuyv : FrameEncoding::bgr;
}

std::optional<std::int64_t> plausible_frames(double frames) {
  constexpr double most = 1e9;  // A header may claim any number.
  if (!(frames >= 1 && frames < most)) return std::nullopt;
  return static_cast<std::int64_t>(frames);
}

std::optional<std::int64_t> sequence_of(const AVPacket& packet) {
  std::size_t size = 0;
  const std::uint8_t* data = av_packet_get_side_data(&packet, AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL, &size);
  // Eight bytes of an id precede the sequence number.
  if (data == nullptr || size != 16) return std::nullopt;
  std::uint64_t sequence = 0;
  for (std::size_t i = 8; i < 16; ++i) sequence = sequence << 8 | data[i];
  constexpr std::uint64_t most = std::uint64_t{1} << 53;
  return sequence < most ? std::optional(static_cast<std::int64_t>(sequence)) : std::nullopt;
}

/// Used only for files of LogWriter, because a tool that cuts a log copies this tag, right or wrong.
std::int64_t start_of(const AVDictionary* tags) {
  const std::int64_t unix_us = std::atoll(tag_of(tags, kStartTag).c_str());
  return unix_us > 0 && unix_us < kMaxUnixUs ? unix_us : 0;
}

/// Returns the number of quarter turns, clockwise, by which players rotate the images; nothing if they
/// transform them in any other way.
std::optional<int> quarter_turns(const AVStream& stream) {
  const std::uint8_t* data = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (data == nullptr) return 0;
  std::array<std::int32_t, 9> matrix;
  std::memcpy(matrix.data(), data, sizeof matrix);
  const double turns = -av_display_rotation_get(matrix.data()) / 90;
  const bool mirrors = 1.0 * matrix[0] * matrix[4] < 1.0 * matrix[1] * matrix[3];
  if (mirrors || !(std::abs(turns - std::round(turns)) < 0.01)) return std::nullopt;
  return (static_cast<int>(std::round(turns)) + 4) % 4;
}

}  // namespace

struct VideoFile::Av {
  AVFormatContext* file = nullptr;
  AVStream* stream = nullptr;
  AVCodecContext* codec = nullptr;
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  AVFrame* bgr = av_frame_alloc();
  SwsContext* scaler = nullptr;
  int format = AV_PIX_FMT_NONE, colors = AVCOL_SPC_UNSPECIFIED;  // Input format of the scaler.
  int turns = 0;                                                 // Quarter turns, clockwise.
  std::int64_t sent = 0, received = 0;
  bool is_predicted = false;  // True if images may depend on others.
  // True if, since a damaged image, there was none that depends on no other image.
  bool is_reference_broken = false;

  Av() = default;
  Av(const Av&) = delete;
  Av& operator=(const Av&) = delete;
  ~Av() {
    sws_freeContext(scaler);
    const Quiet quiet;
    av_frame_free(&bgr);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&codec);
    avformat_close_input(&file);
  }

  bool open(const std::filesystem::path& path, const char* only_format) {
    // A frame cut off by the end of a truncated file must not be delivered partly gray. Playlists, which
    // refer to other files, and text, which would be drawn as images, are not accepted as videos.
    AVDictionary* options = nullptr;
    av_dict_set(&options, "fflags", "discardcorrupt", 0);
    av_dict_set(&options, "format_whitelist", only_format ? only_format : kContainers, 0);
    // The protocol is given, so that no part of the name is taken for one.
    const std::string url = "file:" + std::filesystem::absolute(path).string();
    const AVInputFormat* only = only_format == nullptr ? nullptr : av_find_input_format(only_format);
    const bool is_open = avformat_open_input(&file, url.c_str(), only, &options) >= 0;
    av_dict_free(&options);
    return is_open;
  }

  bool open_decoder() {
    const AVCodec* decoder = avcodec_find_decoder(stream->codecpar->codec_id);
    codec = avcodec_alloc_context3(decoder);
    if (decoder == nullptr || codec == nullptr) return false;
    codec->max_pixels = kMaxPicturePixels;
    codec->thread_count = 0;  // As many threads as cores.
    // With a thread per image, messages would appear outside our calls, where they are not silenced (Quiet).
    codec->thread_type = FF_THREAD_SLICE;
    const AVCodecDescriptor* properties = avcodec_descriptor_get(stream->codecpar->codec_id);
    is_predicted = properties == nullptr || (properties->props & AV_CODEC_PROP_INTRA_ONLY) == 0;
    return avcodec_parameters_to_context(codec, stream->codecpar) >= 0 &&
           avcodec_open2(codec, decoder, nullptr) >= 0;
  }

  /// Reads the next packet of the video; returns false at the end.
  bool read() {
    do {
      av_packet_unref(packet);
      if (av_read_frame(file, packet) < 0) return false;
    } while (packet->stream_index != stream->index || packet->size <= 0);
    return true;
  }

  /// Reads packets until the decoder returns a frame or fails to (then `frame` has no pixels); at the end of
  /// the file it returns the frames that the decoder still holds. Returns false when there are no more.
  bool receive() {
    for (;;) {
      int result = avcodec_receive_frame(codec, frame);
      if (result == AVERROR_EOF) return false;
      if (result == AVERROR(EAGAIN)) {
        const bool any = read();
        result = avcodec_send_packet(codec, any ? packet : nullptr);
        if (any) ++sent;
        if (result >= 0) continue;
        if (!any) return false;
      }
      if (result < 0) {
        av_frame_unref(frame);
        if (received >= sent) return false;  // There must not be more failures than packets.
      }
      ++received;
      return true;
    }
  }

  /// Says whether the frame of receive() is complete. An image that is predicted from a damaged one counts as
  /// damaged, too.
  bool is_whole() {
    const bool whole = frame->data[0] != nullptr && (frame->flags & AV_FRAME_FLAG_CORRUPT) == 0 &&
                       frame->decode_error_flags == 0;
    if (!whole)
      is_reference_broken = is_predicted;
    else if (frame->pict_type == AV_PICTURE_TYPE_I)
      is_reference_broken = false;
    return whole && !is_reference_broken;
  }

  /// Converts into memory allocated by libav, whose fast code writes beyond the end of a row.
  bool convert() {
    // sws_getCachedContext() would create a new scaler for each frame of the JPEG formats, which it renames.
    if (scaler == nullptr || bgr->width != frame->width || bgr->height != frame->height ||
        format != frame->format || colors != frame->colorspace) {
      sws_freeContext(scaler);
      format = frame->format;
      colors = frame->colorspace;
      scaler = sws_getContext(frame->width, frame->height, static_cast<AVPixelFormat>(format), frame->width,
                              frame->height, AV_PIX_FMT_BGR24,
                              SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr);
      obey_color_tags();
    }
    av_frame_unref(bgr);
    bgr->format = AV_PIX_FMT_BGR24;
    bgr->width = frame->width;
    bgr->height = frame->height;
    return scaler != nullptr && av_frame_get_buffer(bgr, 0) >= 0 &&
           sws_scale(scaler, frame->data, frame->linesize, 0, frame->height, bgr->data, bgr->linesize) > 0;
  }

  /// Sets the matrix and the range of luma and chroma (BT.601 if the file does not specify them).
  void obey_color_tags() {
    int *from = nullptr, *to = nullptr, from_full = 0, to_full = 0, brightness = 0, contrast = 0,
        saturation = 0;
    if (scaler == nullptr || sws_getColorspaceDetails(scaler, &from, &from_full, &to, &to_full, &brightness,
                                                      &contrast, &saturation) < 0)
      return;
    if (frame->color_range != AVCOL_RANGE_UNSPECIFIED) from_full = frame->color_range == AVCOL_RANGE_JPEG;
    sws_setColorspaceDetails(scaler, sws_getCoefficients(colors), from_full, to, to_full, brightness,
                             contrast, saturation);
  }

  std::optional<std::int64_t> microseconds(std::int64_t ticks) const {
    if (ticks == AV_NOPTS_VALUE) return std::nullopt;
    return av_rescale_q(ticks, stream->time_base, AVRational{1, 1'000'000});
  }

  /// Returns the number of images in a complete index before any is read; 0 if there is no index. An AVI
  /// contains no image for a dropped frame, and the edit list of an MP4 may leave some out.
  std::int64_t indexed_frames(int track) const {
    std::int64_t frames = 0;
    int count = 0;
    AVStream* const of = video(track, count);
    for (int i = 0; of != nullptr && i < avformat_index_get_entries_count(of); ++i)
      frames += (avformat_index_get_entry(of, i)->flags & AVINDEX_DISCARD_FRAME) == 0;
    return frames;
  }

  /// Returns nullptr if there is none.
  AVStream* video(int track, int& count) const {
    AVStream* found = nullptr;
    for (AVStream* one : std::span(file->streams, file->nb_streams))
      if (one->codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
          (one->disposition & AV_DISPOSITION_ATTACHED_PIC) == 0 && ++count == std::max(track, 1))
        found = one;
    return found;
  }
};

VideoFile::VideoFile(const std::filesystem::path& path, const char* format, int track)
    : path_(path), av_(std::make_unique<Av>()) {
  const Quiet quiet;
  const Error unreadable(path.string() + ": not a video that can be read (or damaged from the start)");
  const bool matroska = is_matroska(path);
  if (!av_->open(path, matroska ? "matroska" : format)) throw unreadable;
  const std::int64_t indexed = matroska ? 0 : av_->indexed_frames(track);
  if (!matroska && avformat_find_stream_info(av_->file, nullptr) < 0) throw unreadable;
  find_video(matroska, track);
  if (indexed > 0 && properties_.frames_are_counted && properties_.frames)
    properties_.frames = std::min(*properties_.frames, indexed);
  check_picture_size(path, properties_.width_px, properties_.height_px);
  const bool decodes = properties_.encoding == FrameEncoding::bgr;
  // Packets are delivered unchanged.
  if (matroska && !decodes) av_->file->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;
  if (matroska && decodes && avformat_find_stream_info(av_->file, nullptr) < 0) throw unreadable;
  if (decodes && !av_->open_decoder()) throw unreadable;
}

VideoFile::~VideoFile() = default;

void VideoFile::find_video(bool is_matroska, int track) {
  Properties& p = properties_;
  const std::string path = path_.string();
  p.ours = tag_of(av_->file->metadata, "encoder") == kLogApplication;
  av_->stream = av_->video(p.ours ? 1 : track, p.tracks);
  if (p.tracks > 1 && p.ours)
    throw Error(path + ": a log of two sensors, as older versions made; take one out with: ffmpeg -i " +
                path + " -map 0:v:0 -c copy first.mkv, and name its configuration and model");
  if (p.tracks == 0) throw Error(path + ": holds no video");
  if (av_->stream == nullptr)
    throw Error(fmt::format("{}: has {}, and no track {}", path, counted(p.tracks, "video track"), track));
  for (AVStream* stream : std::span(av_->file->streams, av_->file->nb_streams))
    if (stream != av_->stream) stream->discard = AVDISCARD_ALL;
  p.encoding = encoding_of(*av_->stream->codecpar);
  p.width_px = av_->stream->codecpar->width;
  p.height_px = av_->stream->codecpar->height;
  const std::optional<int> turns = quarter_turns(*av_->stream);
  if (!turns || (*turns != 0 && p.encoding != FrameEncoding::bgr))
    throw Error(path + ": its tags say that it is shown turned or mirrored; save it without them");
  av_->turns = *turns;
  if (*turns % 2 != 0) std::swap(p.width_px, p.height_px);
  const double rate_hz = av_q2d(av_->stream->avg_frame_rate);
  if (std::isfinite(rate_hz) && rate_hz >= 0.01 && rate_hz <= 10000.0) p.rate_hz = rate_hz;
  p.duration_s = static_cast<double>(av_->file->duration) / AV_TIME_BASE;
  if (p.duration_s <= 0)
    p.duration_s = static_cast<double>(av_->stream->duration) * av_q2d(av_->stream->time_base);
  p.duration_s = std::max(p.duration_s, 0.0);
  if (p.ours) p.start_unix_us = start_of(av_->file->metadata);
  // The number written by LogWriter. A tool that cuts a log copies it, right or wrong.
  p.frames_are_counted = p.ours || (!is_matroska && av_->stream->nb_frames > 0);
  p.frames = plausible_frames(p.ours ? std::atof(tag_of(av_->file->metadata, kFramesTag).c_str())
                              : p.frames_are_counted ? static_cast<double>(av_->stream->nb_frames)
                                                     : std::round(p.duration_s * p.rate_hz));
}

std::optional<VideoFile::Packet> VideoFile::next() {
  const Quiet quiet;
  return properties_.encoding == FrameEncoding::bgr ? next_decoded() : next_as_it_is();
}

std::optional<VideoFile::Packet> VideoFile::next_as_it_is() {
  if (!av_->read()) return std::nullopt;
  const AVPacket& packet = *av_->packet;
  Packet result;
  result.frame.encoding = properties_.encoding;
  result.frame.width_px = properties_.width_px;
  result.frame.height_px = properties_.height_px;
  result.frame.bytes.assign(packet.data, packet.data + packet.size);
  // A PNG track is described as in AVI files, and libav then reports its times as decoding times.
  result.time_us = av_->microseconds(packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts);
  result.sequence = sequence_of(packet);
  return result;
}

/// A damaged image has no time, because a decoder with several threads reports errors late.
std::optional<VideoFile::Packet> VideoFile::next_decoded() {
  if (!av_->receive()) return std::nullopt;
  Packet result;
  if (!av_->is_whole() || !av_->convert()) {
    result.frame.damage = "the picture cannot be decoded without errors";
    return result;
  }
  const AVFrame& bgr = *av_->bgr;
  cv::Mat3b picture(bgr.height, bgr.width, reinterpret_cast<cv::Vec3b*>(bgr.data[0]),
                    static_cast<std::size_t>(bgr.linesize[0]));
  constexpr std::array codes{cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  if (av_->turns > 0) cv::rotate(picture.clone(), picture, codes[static_cast<std::size_t>(av_->turns - 1)]);
  put_picture(picture, result.frame);
  const AVFrame& frame = *av_->frame;
  const bool has_time = frame.pts != AV_NOPTS_VALUE && frame.pts != 0;
  result.time_us = av_->microseconds(has_time ? frame.pts : frame.pkt_dts);
  return result;
}

LogAttachments VideoFile::attachments() const {
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
