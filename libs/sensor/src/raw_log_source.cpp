#include "raw_log_source.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_decoder.hpp"
#include "gelslam/sensor/image_input.hpp"

namespace gelslam::detail {
namespace {

class DecodingSource final : public FrameSource {
 public:
  DecodingSource(std::unique_ptr<RawFrameSource> raw, const std::filesystem::path& log,
                 const SensorProfile& profile)
      : raw_(std::move(raw)), name_(log.string()), decoder_(profile) {}

  std::optional<TactileImage> next() override {
    while (const std::optional<RawFrame> frame = raw_->next()) {
      std::optional<TactileImage> image = decode(*frame);
      if (!image) {
        if (damaged_++ == 0)
          first_damage_ = "frame " + std::to_string(frame->index) + ": " + decoder_.damage();
        continue;
      }
      if (is_grey(image->bgr)) {
        throw Error(name_ + ", frame " + std::to_string(frame->index) +
                    ": a grey picture; slopes are read from the sensor's colours, give the colour video");
      }
      ++delivered_;
      return image;
    }
    if (delivered_ == 0)
      throw Error(name_ + ": the log holds no readable frame" +
                  (damaged_ > 0 ? " (" + first_damage_ + ")" : ""));
    return std::nullopt;
  }

  std::optional<std::int64_t> frame_count() const override { return raw_->frame_count(); }
  double rate_hz() const override { return raw_->rate_hz(); }
  std::string description() const override { return raw_->description(); }

  std::string warning() const override {
    std::string text = raw_->warning();
    if (damaged_ == 0) return text;
    if (!text.empty()) text += "; ";
    return text + std::to_string(damaged_) + " damaged pictures were left out (the first: " + first_damage_ +
           ")";
  }

 private:
  std::optional<TactileImage> decode(const RawFrame& frame) {
    try {
      return decoder_.decode(frame);
    } catch (const Error& error) {
      throw Error(name_ + ", " + error.what());
    }
  }

  std::unique_ptr<RawFrameSource> raw_;
  std::string name_;
  FrameDecoder decoder_;
  std::int64_t delivered_ = 0, damaged_ = 0;
  std::string first_damage_;
};

}  // namespace

std::unique_ptr<FrameSource> open_matroska_frames(const std::filesystem::path& log,
                                                  const SensorProfile& profile) {
  std::unique_ptr<RawFrameSource> raw = open_matroska_log(log, profile);
  if (raw == nullptr) return nullptr;
  return std::make_unique<DecodingSource>(std::move(raw), log, profile);
}

}  // namespace gelslam::detail
