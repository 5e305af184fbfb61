#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {

/// Decoded pictures to surfaces, offline and live alike: color gain, background, estimate. The background is
/// an image that the user names, or is taken from the first pictures in a row that show the bare gel. Not
/// thread-safe.
class FrameToSurface {
 public:
  /// `background`: an image file, or empty. `force`: take the first pictures even if they show contact.
  /// `named`: the pictures that a person named, instead of the first ones. Throws Error when the model or the
  /// image cannot be read.
  FrameToSurface(const Config& config, const std::filesystem::path& background, bool force, StageTimer& timer,
                 const std::optional<FrameRange>& named = {});

  /// Applies the color gain to `bgr` in place. `index`: of the frame in the log. Null for pictures that go
  /// into the background, or come before it. Throws Error when the pictures that were named do not agree.
  SurfacePtr push(cv::Mat3b& bgr, std::int64_t index);
  /// Takes the background from the longest bare stretch of `seen` (find_bare_stretch), which `log` begins
  /// with. Nothing where there is none.
  std::optional<BareStretch> take_bare_stretch(const std::deque<TactileImage>& seen,
                                               const std::filesystem::path& log);
  /// Adds to the warnings how the background that was named differs from what a log begins with.
  void compare_named_background(const std::deque<TactileImage>& first);
  bool has_background() const { return estimator_.has_value() && !compares_; }
  /// The camera was away: pictures go into a second background, which is compared with the first one.
  void compare_background();
  /// What differs, as a sentence for the user, once that was done; or "".
  const std::string& difference() const { return difference_; }
  /// Why the newest pictures are not the background: contact or markers. No reason while there are too few.
  const BackgroundCheck& refusal() const { return refusal_; }
  /// What makes the background doubtful, as sentences for the user, complete once there is a background;
  /// later that light was not followed.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void gather_background(const cv::Mat3b& bgr, std::int64_t index);
  void set_background(const cv::Mat3b& background);
  void explain_refusal(const cv::Mat3b& background);
  std::vector<cv::Mat3b> brightened(const std::deque<TactileImage>& images) const;
  void compare_with(const cv::Mat3b& background);

  const Config config_;
  const bool force_;
  std::optional<FrameRange> named_;
  StageTimer& timer_;
  ColorGain color_gain_;
  GradientModel model_;
  std::deque<cv::Mat3b> candidates_;
  std::int64_t last_for_background_ = -1;
  BackgroundCheck refusal_;
  std::vector<std::string> warnings_;
  std::optional<SurfaceEstimator> estimator_;
  cv::Mat3b background_;
  bool compares_ = false, light_is_lost_ = false;
  std::string difference_;
};

/// A log, or a camera, as a stream of surfaces. Holds no more pictures at once than it looks through for the
/// background.
class SurfaceStream {
 public:
  struct Item {
    TactileImage image;  ///< without its picture for background frames
    SurfacePtr surface;  ///< null for background frames
  };

  /// Reads the background: the first frames, or, where they show no bare gel, the longest stretch of frames
  /// soon after that does. Throws Error when the log is no log, is shorter than its background, or shows
  /// contact in it (unless input.force).
  SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer);
  /// Starts with a camera. It waits until the gel is bare; `ask` is told once why it waits. Without `ask` as
  /// of a log. `input` names the background only.
  SurfaceStream(std::unique_ptr<FrameSource> source, const LogInput& input, const Config& config,
                StageTimer& timer, const std::function<void(const std::string&)>& ask);

  /// Frames in order, background frames first; nothing at the end.
  std::optional<Item> next();
  std::optional<std::int64_t> frame_count() const { return source_->frame_count(); }
  std::string description() const { return source_->description(); }
  /// FrameToSurface::warnings().
  const std::vector<std::string>& background_warnings() const { return frames_.warnings(); }
  /// Damaged pictures so far.
  std::int64_t left_out() const { return source_->left_out(); }
  /// What was wrong with the log, for the user, or "" (complete at the end).
  std::string warning() const { return source_->warning(); }

 private:
  void read_ahead(std::deque<TactileImage>& seen, std::size_t most);
  bool look_further(std::deque<TactileImage> seen, std::size_t most, const std::filesystem::path& log);
  std::optional<TactileImage> next_image();

  StageTimer& timer_;
  std::unique_ptr<FrameSource> source_;  // opened first: a missing log is said before a missing model
  FrameToSurface frames_;
  std::deque<Item> background_items_;  // not handed out yet
  std::deque<TactileImage> ahead_;     // read while the background was looked for
};

}  // namespace gelslam
