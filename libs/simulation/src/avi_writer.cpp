#include "avi_writer.hpp"

extern "C" {
#include <libavformat/avformat.h>
}

#include <cmath>
#include <cstring>

#include "gelslam/core/error.hpp"

namespace gelslam::simulation::detail {
struct AviWriter::Muxer {
  struct PacketDeleter {
    void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  };
  AVFormatContext* context = nullptr;
  std::unique_ptr<AVPacket, PacketDeleter> packet{av_packet_alloc()};
  AVRational picture_time{};

  Muxer() = default;
  Muxer(const Muxer&) = delete;
  Muxer& operator=(const Muxer&) = delete;
  ~Muxer() {
    if (context == nullptr) return;
    avio_closep(&context->pb);
    avformat_free_context(context);
  }
};

AviWriter::AviWriter(const std::filesystem::path& path, bool lossless, int width, int height, double rate_hz)
    : file_(path), path_(path), muxer_(std::make_unique<Muxer>()) {
  AVFormatContext*& context = muxer_->context;
  check(avformat_alloc_output_context2(&context, nullptr, "avi", nullptr));
  context->flags |= AVFMT_FLAG_BITEXACT;  // the same scan gives the same bytes
  AVStream* stream = avformat_new_stream(context, nullptr);
  if (stream == nullptr || muxer_->packet == nullptr) throw Error("out of memory");
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = lossless ? AV_CODEC_ID_PNG : AV_CODEC_ID_MJPEG;
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  muxer_->picture_time = {1000, static_cast<int>(std::lround(1000.0 * rate_hz))};
  stream->time_base = muxer_->picture_time;
  check(avio_open(&context->pb, file_.path().c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(context, nullptr));
}

AviWriter::~AviWriter() = default;

void AviWriter::check(int result) const {
  if (result < 0) throw Error("cannot write " + path_.string() + "; is the disk full?");
}

void AviWriter::add(std::span<const std::uint8_t> picture) {
  AVPacket* packet = muxer_->packet.get();
  check(av_new_packet(packet, static_cast<int>(picture.size())));
  std::memcpy(packet->data, picture.data(), picture.size());
  packet->flags = AV_PKT_FLAG_KEY;
  packet->pts = packet->dts = pictures_++;
  packet->duration = 1;
  av_packet_rescale_ts(packet, muxer_->picture_time, muxer_->context->streams[0]->time_base);
  const int result = av_write_frame(muxer_->context, packet);
  av_packet_unref(packet);
  check(result);
  check(muxer_->context->pb->error);
}

void AviWriter::finish() {
  check(av_write_trailer(muxer_->context));
  check(avio_closep(&muxer_->context->pb));
  file_.commit();
}

}  // namespace gelslam::simulation::detail
