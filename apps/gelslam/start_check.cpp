#include "start_check.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/background_judgement.hpp"

namespace gelslam {

StartCheck::StartCheck(const Config& config, std::function<void(const std::string&)> say_doubt)
    : config_(config), color_gain_(config.color_gain_bgr), say_doubt_(std::move(say_doubt)) {
  decoder_.emplace(config_.sensor);
}

void StartCheck::look_at(const RawFrame& frame) {
  if (!decoder_) return;
  try {
    if (std::optional<TactileImage> image = decoder_->decode(frame)) {
      color_gain_.apply(image->bgr);
      pictures_.push_back(image->bgr.clone());
    } else if (pictures_.empty() && frame.index == 0) {
      say_doubt_("the first picture cannot be decoded: " + decoder_->damage());
    }
    if (static_cast<int>(pictures_.size()) < config_.background_frames) return;
    judge();
  } catch (const Error& error) {  // a size that never fits: the log may be wanted all the same
    say_doubt_(error.what());
  }
  decoder_.reset();
  pictures_.clear();
}

void StartCheck::judge() {
  const std::filesystem::path& file = config_.sensor.calibration_model_path;
  std::optional<GradientModel> model;
  if (!file.empty()) model = read_gradient_model(file);
  const cv::Mat3b mean = background_image(pictures_);
  for (const std::string& doubt :
       judge_background(mean, config_.sensor.device_name, model ? &*model : nullptr))
    say_doubt_(doubt);
  if (!model) return;
  const BackgroundCheck check = check_background(pictures_, *model, config_.surface);
  if (check.contact)
    say_doubt_("the first " + std::to_string(pictures_.size()) + " frames should show the bare gel, but " +
               check.reason);
}

}  // namespace gelslam
