#pragma once

#include <array>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {

namespace surface::detail {
class PixelRepair;
}

/// Returns the mean of images of one size, rounded to the nearest gray level. Throws Error when there are
/// none or sizes differ.
cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images);

/// Returns the mean of pictures of the bare gel, each scaled per channel to the brightness of the last where
/// they differ by more than a hundredth: a camera's exposure may still settle in the first of them. Throws
/// like mean_image.
cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames);

/// Brightness now over then, and gray levels added, of B, G, R.
struct EvenLight {
  std::array<double, 3> gain{1.0, 1.0, 1.0}, offset{0.0, 0.0, 0.0};
};

/// Returns how the light has changed between two pictures of mean colors of one size, as surfaces follow it
/// from frame to frame: per channel now = gain * then + offset, fitted robustly. No change where they have
/// nothing in common.
EvenLight follow_light(const cv::Mat3f& then, const cv::Mat3f& now);

/// Dots printed on a gel, by which other programs measure shear. Slopes cannot be read through them.
struct MarkerDots {
  int count = 0;
  double spacing_px = 0.0, diameter_px = 0.0;
  /// 255 where ink darkens the gel, and around it as far as lens and JPEG spread it. Dots of any kind.
  cv::Mat1b mask{};
  double covered_share = 0.0;  ///< of the picture by the mask
  std::vector<cv::Point2d> centers_px{};
  /// Says whether enough bare gel is seen between the dots to fill them in from around: at most 40 % is
  /// covered.
  bool are_readable() const;
  /// Returns a sentence for the user: "the gel has 63 markers, ...; their pixels are filled in", or why not.
  std::string sentence() const;
};

/// Finds markers in a picture of the bare gel (own): at least nine dark round spots of one size at similar
/// distances from their nearest neighbors. Dirt is irregular and not taken for them. Nothing when there are
/// none, or the picture is smaller than 32 pixels.
std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background);

/// Removes printed markers from pictures of a gel by interpolating the colors around them. Pictures of a gel
/// without markers stay as they are. This step is not in the papers.
class MarkerFiller {
 public:
  explicit MarkerFiller(const cv::Mat3b& background);
  ~MarkerFiller();
  /// The background as it would be without dots.
  const cv::Mat3b& background() const { return background_; }
  /// The picture with its dots filled in from around. `covered` becomes 255 where they are; without markers
  /// it becomes empty.
  cv::Mat3b fill(const cv::Mat3b& bgr, cv::Mat1b& covered) const;

 private:
  cv::Mat3b background_;
  std::unique_ptr<surface::detail::PixelRepair> repair_;  ///< none where the gel has no markers
};

struct BackgroundCheck {
  bool contact = false;
  bool moves = false;    ///< contact that is seen to move
  bool markers = false;  ///< too many on the gel: slopes cannot be read, touched or not
  bool turned = false;   ///< red and blue swapped, or upside down, which looks like contact
  std::string reason{};  ///< for the user; empty when there is neither
  /// Returns what a person at the camera is told where there is contact.
  std::string request() const {
    return (turned ? "" : "take the object off the gel, or continue with force if there is none: ") + reason;
  }
};

/// Says whether pictures that should show the bare gel cannot serve as a background: something moves between
/// them, or the gel has too many markers (MarkerDots::are_readable), or the model reads an imprint in their
/// background_image(), which has locally steep slopes or curvature, where the bare gel has at most a smooth
/// bias. A problem that judge_orientation() finds is reported first, because wrong colors are read as an
/// imprint. A flat object that does not move cannot be distinguished from bare gel. These tests are not in
/// the papers. Throws Error like mean_image, and when the model does not fit.
BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options, const std::string& device_name = "");

/// The pictures from index begin to begin + count - 1.
struct BareStretch {
  std::size_t begin = 0, count = 0;
  double imprint_mm = 0;  ///< depth of an imprint that belongs to the gel itself; 0: there is none
};

/// Finds the bare gel in a log that does not begin with it, for example because its camera first delivered
/// dark or old buffers. This search is not in the papers. Candidates are stretches of at least three
/// consecutive frames that agree with each other, show the bare gel by check_background(), and have no
/// stronger imprint than the other candidates. The result is the first of them whose gel most frames of the
/// log show where nothing touches. If the log returns to this gel, the longest such stretch is taken. It has
/// at most `most` frames. `log`: pictures from the whole log. An imprint that all of them show, while some
/// also show a touch, belongs to the gel (a worn spot, or the light of another sensor). Throws Error when the
/// model does not fit.
std::optional<BareStretch> find_bare_stretch(const std::vector<cv::Mat3b>& frames, std::size_t most,
                                             const GradientModel& model, const SurfaceOptions& options,
                                             const std::vector<cv::Mat3b>& log = {});

/// Message for users of the maker's model (WideNetwork::gives_normals).
inline constexpr const char* kMakerModelWarning =
    "the maker's model does not know this sensor, and heights may be wrong by a sixth: press a ball (gelslam "
    "calibrate scale)";

/// Returns what makes a picture of the bare gel doubtful, as sentences for the user (own): too dark,
/// saturated, without color, markers, dirt or a tear, and judge_lamps. With `model` also a bare gel that the
/// model reads as sloped: another sensor's model, another gel, another exposure; with the maker's model, what
/// such a model does not know. With a pitch also one by which printed dots are not as far apart as the
/// maker's. Contact is check_background's job. The limits lie well apart from four real sensors' backgrounds.
/// Throws Error when the picture is smaller than 32 pixels.
std::vector<std::string> judge_background(const cv::Mat3b& mean, const std::string& device_name,
                                          const GradientModel* model = nullptr, double pixel_pitch_mm = 0);

/// The part of judge_background about dirt and tears: share of the picture whose color differs from what is
/// around it more sharply than lamps make it differ. The rim of an imprint does, too. Throws Error when the
/// picture is smaller than 32 pixels.
double stained_share(const cv::Mat3b& picture);

/// The part of judge_background about the lamps of a GelSight Mini, which make the top bluish and the bottom
/// reddish: other colors, red and blue swapped, the picture upside down. A picture mirrored left to right
/// looks the same. "" for other sensors. Throws Error when the picture is smaller than 32 pixels.
std::string judge_lamps(const cv::Mat3b& mean, const std::string& device_name);

/// The part of judge_lamps that no imprint can cause: red and blue swapped, the picture upside down. Throws
/// like it.
std::string judge_orientation(const cv::Mat3b& mean, const std::string& device_name);

/// Throws Error for a background that no calibration can use: a gel with too many markers, red and blue
/// swapped. Other warnings are reported by `say_warning`. `name` stands for the background in messages.
void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_warning);

}  // namespace gelslam
