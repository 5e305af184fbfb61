#include "gelslam/sensor/frame_source.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/raw_log.hpp"

namespace gelslam {

FrameSource::FrameSource(std::shared_ptr<RawFrameSource> raw, std::string name, const SensorProfile& profile)
    : raw_(std::move(raw)), name_(std::move(name)), decoder_(profile) {}

std::optional<TactileImage> FrameSource::next() {
  constexpr std::int64_t patience = 10;  // where nothing but damage comes, the log is the wrong one
  while (std::optional<RawFrame> frame = raw_->next()) {
    if (frame->name.empty()) frame->name = name_ + ", frame " + std::to_string(frame->index);
    if (std::optional<TactileImage> image = decoder_.decode(*frame)) return image;
    if (decoder_.good() == 0 && decoder_.left_out() == patience) break;
  }
  if (decoder_.good() == 0 && decoder_.left_out() > 0) throw Error(decoder_.first_damage());
  return std::nullopt;
}

std::string FrameSource::warning() const {
  std::string text = raw_->warning();
  append_sentence(text, decoder_.warning());
  return text;
}

std::unique_ptr<FrameSource> open_frame_source(const std::filesystem::path& log,
                                               const SensorProfile& profile) {
  return std::make_unique<FrameSource>(open_raw_log(log, profile), log.string(), profile);
}

}  // namespace gelslam
