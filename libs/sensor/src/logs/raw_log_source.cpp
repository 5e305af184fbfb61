#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "images/left_out.hpp"
#include "images/sources.hpp"

namespace gelslam {
namespace detail {
namespace {

class DecodingSource final : public FrameSource {
 public:
  DecodingSource(std::shared_ptr<RawFrameSource> raw, const std::string& name, const SensorProfile& profile)
      : raw_(std::move(raw)), name_(name), decoder_(profile) {}

  std::optional<TactileImage> next() override {
    while (const std::optional<RawFrame> frame = raw_->next()) {
      std::optional<TactileImage> image = decode(*frame);
      if (image && !is_gray(image->bgr)) {
        pictures_.use();
        return image;
      }
      pictures_.leave_out(name_ + ", frame " + std::to_string(frame->index) + ": " +
                          (image ? kGrayPicture : decoder_.damage()));
    }
    pictures_.require_some(name_ + ": the log");
    return std::nullopt;
  }

  std::optional<std::int64_t> frame_count() const override { return raw_->frame_count(); }
  double rate_hz() const override { return raw_->rate_hz(); }
  std::string description() const override { return raw_->description(); }

  std::string warning() const override { return joined({raw_->warning(), pictures_.warning()}); }

 private:
  std::optional<TactileImage> decode(const RawFrame& frame) {
    try {
      return decoder_.decode(frame);
    } catch (const Error& error) {
      throw Error(name_ + ", " + error.what());
    }
  }

  std::shared_ptr<RawFrameSource> raw_;
  std::string name_;
  FrameDecoder decoder_;
  LeftOut pictures_;
};

}  // namespace

std::unique_ptr<FrameSource> open_matroska_frames(const std::filesystem::path& log,
                                                  const SensorProfile& profile) {
  std::unique_ptr<RawFrameSource> raw = open_matroska_log(log, profile);
  if (raw == nullptr) return nullptr;
  return decode_frames(std::move(raw), log.string(), profile);
}

}  // namespace detail

std::unique_ptr<FrameSource> decode_frames(std::shared_ptr<RawFrameSource> raw, const std::string& name,
                                           const SensorProfile& profile) {
  return std::make_unique<detail::DecodingSource>(std::move(raw), name, profile);
}

}  // namespace gelslam
