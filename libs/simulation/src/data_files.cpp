#include "data_files.hpp"

extern "C" {
#include <libavformat/avformat.h>
}

#include <fmt/core.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "gelslam/core/error.hpp"

namespace gelslam::simulation::detail {

std::string config_yaml(const std::filesystem::path& folder, const SensorGeometry& geometry,
                        double frame_rate_hz, const std::filesystem::path& model) {
  std::string named;
  if (!model.empty()) {
    const std::filesystem::path there = std::filesystem::absolute(model).lexically_normal();
    const std::filesystem::path here = std::filesystem::absolute(folder).lexically_normal();
    named =
        "  calibration_model_path: " + nlohmann::json(there.lexically_relative(here).string()).dump() + "\n";
  }
  // The public system requires this key. 2 mm² is this program's default.
  const double contact_px = 2 / (geometry.pixel_pitch_mm * geometry.pixel_pitch_mm);
  return fmt::format(
      "# Configuration of the Device\ndevice_config:\n  device_name: \"GelSight Mini\"\n  ppmm: {:g}\n"
      "  imgh: {}\n  imgw: {}\n  raw_imgh: 2464\n  raw_imgw: 3280\n  framerate: {:g}\n{}"
      "contact_mask_config:\n  color_dist_threshold: 15\n  height_threshold: 0.2\n"
      "gelslam_config:\n  track_config:\n    contact_threshold: {:.0f}\n    scr_threshold: 0.3\n"
      "    ccs_threshold: 0.7\n  pose_graph_config:\n    coverage_graph_overlap_threshold: 50\n"
      "    min_sift_inliers: 8\n    scr_threshold: 0.3\n    ccs_threshold: 0.7\n",
      geometry.pixel_pitch_mm, geometry.height_px, geometry.width_px, frame_rate_hz, named, contact_px);
}

AviWriter::AviWriter(const std::filesystem::path& path, int width, int height, double rate_hz)
    : file_(path),
      path_(path),
      muxer_(nullptr,
             [](AVFormatContext* context) {
               avio_closep(&context->pb);
               avformat_free_context(context);
             }),
      packet_(av_packet_alloc(), [](AVPacket* packet) { av_packet_free(&packet); }),
      millihertz_(static_cast<int>(std::lround(1000.0 * rate_hz))) {
  AVFormatContext* context = nullptr;
  check(avformat_alloc_output_context2(&context, nullptr, "avi", nullptr));
  muxer_.reset(context);
  context->flags |= AVFMT_FLAG_BITEXACT;  // Makes the bytes of the file depend on the scan only.
  AVStream* stream = avformat_new_stream(context, nullptr);
  if (stream == nullptr || packet_ == nullptr) throw Error("out of memory");
  stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
  stream->codecpar->codec_id = AV_CODEC_ID_MJPEG;
  stream->codecpar->width = width;
  stream->codecpar->height = height;
  stream->time_base = {1000, millihertz_};
  check(avio_open(&context->pb, file_.path().c_str(), AVIO_FLAG_WRITE));
  check(avformat_write_header(context, nullptr));
}

void AviWriter::check(int result) const {
  if (result < 0) throw Error("cannot write " + path_.string() + "; is the disk full?");
}

void AviWriter::add(std::span<const std::uint8_t> picture) {
  AVPacket* packet = packet_.get();
  check(av_new_packet(packet, static_cast<int>(picture.size())));
  std::memcpy(packet->data, picture.data(), picture.size());
  packet->flags = AV_PKT_FLAG_KEY;
  packet->pts = packet->dts = pictures_++;
  packet->duration = 1;
  av_packet_rescale_ts(packet, {1000, millihertz_}, muxer_->streams[0]->time_base);
  const int result = av_write_frame(muxer_.get(), packet);
  av_packet_unref(packet);
  check(result);
  check(muxer_->pb->error);
}

void AviWriter::finish() {
  check(av_write_trailer(muxer_.get()));
  check(avio_closep(&muxer_->pb));
  file_.commit();
}

}  // namespace gelslam::simulation::detail
