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

/// Converts decoded images to surfaces, both offline and live: color gain, background, surface estimate. The
/// background is an image file that the user names, or is made from the first consecutive images that show
/// the gel without contact. Not thread-safe.
class FrameToSurface {
 public:
  /// `background` is an image file, or empty. `force` uses the first images even if they show contact.
  /// `named` are images that the user named to be used instead of the first ones. Throws Error when the model
  /// or the image cannot be read.
  FrameToSurface(const Config& config, const std::filesystem::path& background, bool force, StageTimer& timer,
                 const std::optional<FrameRange>& named = {});

  /// Computes the surface of an image, after applying the color gain to `bgr` in place. `index` is the
  /// frame's number in the log. Returns null for images that become part of the background or come before it.
  /// Throws Error when the images that the user named differ too much from each other.
  SurfacePtr push(cv::Mat3b& bgr, std::int64_t index);
  /// Makes the background from the longest sequence of images without contact among `seen`, the first images
  /// of `log` (find_bare_stretch). Returns nothing if there is no such sequence.
  std::optional<BareStretch> take_bare_stretch(const std::deque<TactileImage>& seen,
                                               const std::filesystem::path& log);
  /// Adds a warning if the background that the user named differs from the log's first images.
  void compare_named_background(const std::deque<TactileImage>& first);
  bool has_background() const { return estimator_.has_value() && !compares_; }
  /// To be called after the camera was disconnected: the next images make a second background, which is
  /// compared with the first one.
  void compare_background();
  /// Returns the difference between both backgrounds as a sentence for the user, once they were compared; or
  /// "".
  const std::string& difference() const { return difference_; }
  /// Returns why the newest images cannot be the background (contact or markers). Gives no reason while there
  /// are too few images.
  const BackgroundCheck& refusal() const { return refusal_; }
  /// Returns reasons to doubt the background as sentences for the user, complete once there is a background.
  /// Later a warning may be added that a change of light was too large to be corrected.
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

/// A log or a camera as a sequence of surfaces. It never holds more images than are searched for the
/// background.
class SurfaceStream {
 public:
  struct Item {
    TactileImage image;  ///< without its picture for background frames
    SurfacePtr surface;  ///< null for background frames
  };

  /// Opens a log and reads its background: the first frames, or, if they show contact, the longest sequence
  /// of frames without contact soon after. Throws Error when the file is no log, has fewer frames than the
  /// background needs, or shows contact in all of these (unless input.force).
  SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer);
  /// Starts with a camera. Without a background image it waits until the gel has no contact, and calls `ask`
  /// once with the reason. If `ask` is empty, the background is read as from a log. `input` is used for the
  /// background only.
  SurfaceStream(std::unique_ptr<FrameSource> source, const LogInput& input, const Config& config,
                StageTimer& timer, const std::function<void(const std::string&)>& ask);

  /// Returns the frames in order, background frames first, and nothing at the end.
  std::optional<Item> next();
  std::optional<std::int64_t> frame_count() const { return source_->frame_count(); }
  std::string description() const { return source_->description(); }
  /// FrameToSurface::warnings().
  const std::vector<std::string>& background_warnings() const { return frames_.warnings(); }
  /// Damaged pictures so far.
  std::int64_t left_out() const { return source_->left_out(); }
  /// Problem of the log as a sentence for the user, or "" (complete at the end).
  std::string warning() const { return source_->warning(); }

 private:
  void read_ahead(std::deque<TactileImage>& seen, std::size_t most);
  bool look_further(std::deque<TactileImage> seen, std::size_t most, const std::filesystem::path& log);
  std::optional<TactileImage> next_image();

  StageTimer& timer_;
  // Opened first, so that a missing log is reported before a missing model.
  std::unique_ptr<FrameSource> source_;
  FrameToSurface frames_;
  std::deque<Item> background_items_;  // Background frames that next() has not returned yet.
  std::deque<TactileImage> ahead_;     // Images that were read while searching for the background.
};

}  // namespace gelslam
