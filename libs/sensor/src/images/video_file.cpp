#include "images/video_file.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <cmath>

#include "gelslam/core/error.hpp"
#include "images/crop.hpp"

namespace gelslam::detail {
namespace {

/// Options of libav, freed with the object.
struct AvOptions {
  AvOptions(const char* key, const char* value) { av_dict_set(&dictionary, key, value, 0); }
  ~AvOptions() { av_dict_free(&dictionary); }
  AvOptions(const AvOptions&) = delete;
  AvOptions& operator=(const AvOptions&) = delete;
  AVDictionary* dictionary = nullptr;
};

}  // namespace

struct VideoFile::Av {
  AVFormatContext* file = nullptr;
  AVStream* stream = nullptr;
  AVCodecContext* codec = nullptr;
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  AVFrame* bgr = av_frame_alloc();
  SwsContext* scaler = nullptr;
  int format = AV_PIX_FMT_NONE;  // that the scaler reads

  Av() = default;
  Av(const Av&) = delete;
  Av& operator=(const Av&) = delete;
  ~Av() {
    sws_freeContext(scaler);
    av_frame_free(&bgr);
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&codec);
    avformat_close_input(&file);
  }

  bool open(const std::filesystem::path& path, const char* format);
  bool open_decoder();
  bool convert();
};

bool VideoFile::Av::open(const std::filesystem::path& path, const char* format) {
  // A frame cut off by the end of a truncated file must not reach us half gray.
  AvOptions options("fflags", "discardcorrupt");
  file = open_container(path, format, &options.dictionary);
  if (file == nullptr || avformat_find_stream_info(file, nullptr) < 0) return false;
  const int index = av_find_best_stream(file, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (index < 0) return false;
  stream = file->streams[index];
  return true;
}

bool VideoFile::Av::open_decoder() {
  const AVCodec* decoder = avcodec_find_decoder(stream->codecpar->codec_id);
  codec = avcodec_alloc_context3(decoder);
  if (decoder == nullptr || codec == nullptr) return false;
  codec->max_pixels = kMostPicturePixels;
  codec->thread_count = 0;  // as many as there are cores
  return avcodec_parameters_to_context(codec, stream->codecpar) >= 0 &&
         avcodec_open2(codec, decoder, nullptr) >= 0;
}

/// Into libav's own memory: its fast paths write beyond the end of a row.
bool VideoFile::Av::convert() {
  // (sws_getCachedContext() makes a new one for each frame of the formats of JPEG, which it renames.)
  if (scaler == nullptr || bgr->width != frame->width || bgr->height != frame->height ||
      format != frame->format) {
    sws_freeContext(scaler);
    format = frame->format;
    scaler = sws_getContext(frame->width, frame->height, static_cast<AVPixelFormat>(format), frame->width,
                            frame->height, AV_PIX_FMT_BGR24, SWS_BICUBIC, nullptr, nullptr, nullptr);
  }
  av_frame_unref(bgr);
  bgr->format = AV_PIX_FMT_BGR24;
  bgr->width = frame->width;
  bgr->height = frame->height;
  return scaler != nullptr && av_frame_get_buffer(bgr, 0) >= 0 &&
         sws_scale(scaler, frame->data, frame->linesize, 0, frame->height, bgr->data, bgr->linesize) > 0;
}

VideoFile::VideoFile(const std::filesystem::path& path, const char* format) : av_(std::make_unique<Av>()) {
  const Error unreadable(path.string() + ": not a video that can be read (or damaged from the start)");
  if (!av_->open(path, format)) throw unreadable;
  find_properties();
  check_picture_size(path, properties_.width_px, properties_.height_px);
  if (!av_->open_decoder()) throw unreadable;
}

VideoFile::~VideoFile() = default;

void VideoFile::find_properties() {
  properties_.width_px = av_->stream->codecpar->width;
  properties_.height_px = av_->stream->codecpar->height;
  const AVRational rate = av_->stream->avg_frame_rate;
  if (rate.num > 0 && rate.den > 0) properties_.rate_hz = av_q2d(rate);
  double duration_s = static_cast<double>(av_->file->duration) / AV_TIME_BASE;
  if (duration_s <= 0)
    duration_s = static_cast<double>(av_->stream->duration) * av_q2d(av_->stream->time_base);
  const double frames = av_->stream->nb_frames > 0 ? static_cast<double>(av_->stream->nb_frames)
                                                   : std::floor(duration_s * properties_.rate_hz + 0.5);
  properties_.frames = plausible_frames(frames);
}

/// Reads packets until the decoder gives a frame; at the end of the file those that it has kept.
bool VideoFile::receive() {
  for (;;) {
    const int received = avcodec_receive_frame(av_->codec, av_->frame);
    if (received >= 0) return true;
    if (received == AVERROR_EOF) return false;
    av_packet_unref(av_->packet);
    const bool ended = av_read_frame(av_->file, av_->packet) < 0;
    if (!ended && av_->packet->stream_index != av_->stream->index) continue;
    if (avcodec_send_packet(av_->codec, ended ? nullptr : av_->packet) < 0) return false;
  }
}

double VideoFile::time_of_frame() const {
  const AVFrame& frame = *av_->frame;
  const std::int64_t ticks = frame.pts != AV_NOPTS_VALUE && frame.pts != 0 ? frame.pts : frame.pkt_dts;
  if (ticks == AV_NOPTS_VALUE) return 0;
  const std::int64_t start = av_->stream->start_time != AV_NOPTS_VALUE ? av_->stream->start_time : 0;
  return static_cast<double>(ticks - start) * av_q2d(av_->stream->time_base);
}

std::optional<VideoFile::Frame> VideoFile::next() {
  if (!receive() || !av_->convert()) return std::nullopt;
  const cv::Mat3b bgr(av_->bgr->height, av_->bgr->width, reinterpret_cast<cv::Vec3b*>(av_->bgr->data[0]),
                      static_cast<std::size_t>(av_->bgr->linesize[0]));
  return Frame{bgr.clone(), time_of_frame()};
}

}  // namespace gelslam::detail

extern "C" {}

namespace gelslam::detail {

AVFormatContext* open_container(const std::filesystem::path& path, const char* format,
                                AVDictionary** options) {
  av_log_set_level(AV_LOG_QUIET);  // what is wrong with a file is said by our errors
  // With its protocol, so that no part of the name is taken for one.
  const std::string url = "file:" + std::filesystem::absolute(path).string();
  const AVInputFormat* only = format == nullptr ? nullptr : av_find_input_format(format);
  AVFormatContext* file = nullptr;  // stays null on failure
  avformat_open_input(&file, url.c_str(), only, options);
  return file;
}

std::optional<std::int64_t> plausible_frames(double frames) {
  constexpr double kMost = 1e9;  // a header may claim anything
  if (!(frames >= 1 && frames < kMost)) return std::nullopt;
  return static_cast<std::int64_t>(frames);
}

}  // namespace gelslam::detail
