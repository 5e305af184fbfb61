#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/surface/slopes.hpp"
#include "protocols/trials.hpp"

namespace gelslam {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMinSide = 16, kMaxSide = 4096;

/// Returns one subarray along the first index.
NpyArray slice(const NpyArray& array, std::size_t index) {
  const auto bytes = static_cast<std::ptrdiff_t>(array.data.size() / array.shape[0]);
  const auto first = array.data.begin() + static_cast<std::ptrdiff_t>(index) * bytes;
  return {array.type, {array.shape.begin() + 1, array.shape.end()}, {first, first + bytes}};
}

/// A trial with gradients and masks of the public data.
class ArraySource final : public TrialFrames {
 public:
  explicit ArraySource(const fs::path& folder)
      : truth_(read_ground_truth(folder)),
        gradients_(read_npy(folder / "gradient_maps.npy")),
        masks_(read_npy(folder / "contact_masks.npy")) {
    const fs::path file = folder / "config.yaml";
    if (fs::is_regular_file(file)) config_ = read_config(file);
    check_shapes(folder);
    const cv::Size size(static_cast<int>(gradients_.shape[2]), static_cast<int>(gradients_.shape[1]));
    surfaces_.emplace(CameraModel{size, config_.sensor.pixel_pitch_mm});
    size_ = size;
  }

  std::optional<TrialFrame> next() override {
    if (index_ == truth_.start_T_currs.size()) return std::nullopt;
    const std::vector<double> slopes = slice(gradients_, index_).to_doubles(),
                              mask = slice(masks_, index_).to_doubles();
    cv::Mat1f gx(size_), gy(size_);
    cv::Mat1b touched(size_);
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const int pixel = static_cast<int>(i);
      const float x = static_cast<float>(slopes[2 * i]), y = static_cast<float>(slopes[2 * i + 1]);
      const bool finite = std::isfinite(x) && std::isfinite(y);
      gx(pixel) = finite ? x : 0.0F;
      gy(pixel) = finite ? y : 0.0F;
      touched(pixel) = finite && mask[i] != 0 ? 255 : 0;
    }
    const auto frame = static_cast<std::int64_t>(index_);
    return TrialFrame{frame, static_cast<double>(frame) / truth_.fps, surfaces_->make(gx, gy, touched),
                      truth_.start_T_currs[index_++]};
  }

 private:
  void check_shapes(const fs::path& folder) const {
    const auto& g = gradients_.shape;
    const auto& m = masks_.shape;
    const bool maps = g.size() == 4 && g[3] == 2 && g[1] >= kMinSide && g[2] >= kMinSide &&
                      g[1] <= kMaxSide && g[2] <= kMaxSide;
    if (!maps || m != std::vector<std::size_t>(g.begin(), g.begin() + 3))
      throw Error(folder.string() +
                  ": gradient_maps.npy should be N x H x W x 2, and contact_masks.npy N x H x W");
    if (g[0] != truth_.start_T_currs.size())
      throw Error(folder.string() + ": gradient_maps.npy has " + std::to_string(g[0]) +
                  " frames, but the truth has " + std::to_string(truth_.start_T_currs.size()) +
                  " poses: they do not belong together");
  }

  const GroundTruth truth_;
  NpyArray gradients_, masks_;
  std::optional<GradientSurfaces> surfaces_;
  cv::Size size_;
  std::size_t index_ = 0;
};

class VideoSource final : public TrialFrames {
 public:
  explicit VideoSource(const fs::path& folder) : truth_(read_ground_truth(folder)) {
    const LogInput input{folder, {}, {}, {}, false};
    config_ = resolve_config(input);
    stream_.emplace(input, config_, timer_);
  }

  std::optional<TrialFrame> next() override {
    while (std::optional<SurfaceStream::Item> item = stream_->next()) {
      const std::int64_t index = item->image.index - truth_.background_frames;
      if (index < 0 || !item->surface) continue;
      if (index >= static_cast<std::int64_t>(truth_.start_T_currs.size())) return std::nullopt;
      return TrialFrame{item->image.index, item->image.time_s, std::move(item->surface),
                        truth_.start_T_currs[static_cast<std::size_t>(index)]};
    }
    return std::nullopt;
  }

 private:
  const GroundTruth truth_;
  StageTimer timer_;
  std::optional<SurfaceStream> stream_;
};

}  // namespace

std::unique_ptr<TrialFrames> open_trial(const fs::path& folder) {
  if (fs::exists(folder / "gradient_maps.npy") && fs::exists(folder / "contact_masks.npy"))
    return std::make_unique<ArraySource>(folder);
  return std::make_unique<VideoSource>(folder);
}

}  // namespace gelslam
