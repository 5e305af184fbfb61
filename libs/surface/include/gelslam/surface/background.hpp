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

/// Returns the mean of pictures of the bare gel, each scaled per channel to the mean brightness of the last
/// one if it differs by more than 1 %, because the exposure of a camera may still settle in the first
/// pictures. Throws like mean_image.
cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames);

/// A change of the light that is the same all over the picture: now = gain * then + offset for the channels
/// B, G, R, in gray levels.
struct EvenLight {
  std::array<double, 3> gain{1.0, 1.0, 1.0}, offset{0.0, 0.0, 0.0};
};

/// Estimates by robust regression how the light has changed between two pictures of one size, which are given
/// as mean colors of blocks or cells in gray levels. SurfaceEstimator follows the light from frame to frame
/// in the same way. Returns no change if no light explains at least a tenth of the pictures.
EvenLight follow_light(const cv::Mat3f& then, const cv::Mat3f& now);

/// Dots printed on a gel, with which other programs measure shear. The color of a dot does not depend on the
/// slope, so slopes cannot be read there.
struct MarkerDots {
  int count = 0;
  double spacing_px = 0.0, diameter_px = 0.0;  ///< medians over the dots
  /// 255 where the gel is much darker than its surroundings, dilated by the blur of lens and JPEG. It
  /// includes spots that `count` does not, for example dots at the border of the picture.
  cv::Mat1b mask{};
  double covered_share = 0.0;             ///< the fraction of the picture that the mask covers
  std::vector<cv::Point2d> centers_px{};  ///< column and row in the picture
  /// Returns true if the mask covers at most 40 % of the picture. Enough gel is then seen between the dots to
  /// interpolate over them.
  bool are_readable() const;
  /// Returns a sentence for the user: "the gel has 63 markers, ...; their pixels are filled in", or why not.
  std::string sentence() const;
};

/// Finds printed dots in a picture of the bare gel: at least nine dark spots of similar size at similar
/// distances from their nearest neighbors. Dirt is irregular and is not taken for dots. Returns nothing if
/// there are no dots. This step is not in the papers.
std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background);

/// Removes printed markers from pictures of a gel by interpolating the colors around them. Pictures of a gel
/// without markers stay as they are. This step is not in the papers.
class MarkerFiller {
 public:
  explicit MarkerFiller(const cv::Mat3b& background);
  ~MarkerFiller();
  /// Returns the background as it would be without dots.
  const cv::Mat3b& background() const { return background_; }
  /// Returns a picture with interpolated colors in place of dots and other spots. Sets `covered` to 255
  /// there, or makes it empty if nothing was interpolated.
  cv::Mat3b fill(const cv::Mat3b& bgr, cv::Mat1b& covered) const;

 private:
  cv::Mat3b background_;
  std::unique_ptr<surface::detail::PixelRepair> repair_;  ///< none where the gel has no markers
};

/// The result of check_background. At most one of `contact` and `markers` is set.
struct BackgroundCheck {
  bool contact = false;  ///< an object seems to touch the gel
  bool moves = false;    ///< there is contact, and it was recognized by its motion
  bool markers = false;  ///< printed dots cover so much of the gel that slopes cannot be read
  bool turned = false;   ///< the contact may be an effect of swapped colors or of a picture upside down
  std::string reason{};  ///< explains `contact` or `markers` to the user; empty if neither is set
  /// Returns the message with which a person at the camera is asked to remove the contact.
  std::string request() const {
    return (turned ? "" : "take the object off the gel, or continue with force if there is none: ") + reason;
  }
};

/// Checks whether pictures show the bare gel, so that their background_image() can serve as a background.
/// They do not if something moves between them, if printed dots cover too much of the gel
/// (MarkerDots::are_readable), or if the model reads an imprint in their mean: locally steep slopes with a
/// large curvature, whereas the error of the model on bare gel is smooth. A problem that judge_orientation()
/// finds is put first in the reason, because wrong colors are read as an imprint. A flat object that does not
/// move cannot be distinguished from bare gel. These tests are not in the papers. Throws Error like
/// mean_image.
BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options, const std::string& device_name = "");

/// A stretch of a log that shows the bare gel: the frames with indices begin to begin + count - 1.
struct BareStretch {
  std::size_t begin = 0, count = 0;
  double imprint_mm = 0;  ///< depth of an imprint that belongs to the gel itself, or 0
};

/// Finds the bare gel in a log that does not begin with it, for example because its camera first delivered
/// dark or old buffers. This search is not in the papers. Candidates are stretches of at least three
/// consecutive frames that agree with each other, show the bare gel by check_background(), and have no
/// stronger imprint than the other candidates. The gel is that of the first candidate which at least half of
/// the frames show, each on at least half of its picture. If several stretches show this gel, the longest is
/// taken. At most `most` of its frames are returned; nothing is returned if there is no candidate. All
/// pictures have one size. `log`: pictures from the whole log, or none. An imprint that all of them show,
/// while some also show a touch, belongs to the gel (a worn spot, or a model of another sensor's light) and
/// does not exclude a stretch.
std::optional<BareStretch> find_bare_stretch(const std::vector<cv::Mat3b>& frames, std::size_t most,
                                             const GradientModel& model, const SurfaceOptions& options,
                                             const std::vector<cv::Mat3b>& log = {});

/// The warning for users of the gradient model that GelSight distributes (WideNetwork::gives_normals).
inline constexpr const char* kMakerModelWarning =
    "the maker's model does not know this sensor, and heights may be wrong by a sixth: press a ball (gelslam "
    "calibrate scale)";

/// Returns warnings about a picture of the bare gel as sentences for the user: a picture that is too dark,
/// saturated or without color, printed dots, dirt or a tear, and what judge_lamps() finds. If `model` is
/// given, the result also warns of a gel that this model reads as sloped, because the model then belongs to
/// another sensor, gel or exposure; for the maker's model it contains kMakerModelWarning instead. If
/// `pixel_pitch_mm` is positive, it also warns if a GelSight Mini's printed dots are not 2 mm apart by that
/// pitch. Contact is not judged here, but by check_background(). These checks are not in the papers. Throws
/// Error when a side of the picture is shorter than 32 pixels.
std::vector<std::string> judge_background(const cv::Mat3b& mean, const std::string& device_name,
                                          const GradientModel* model = nullptr, double pixel_pitch_mm = 0);

/// Returns the fraction of the picture (without its border) whose color differs from its surroundings more
/// sharply than lamps can cause: dirt, tears, but also the rim of an imprint. It is a part of
/// judge_background() and throws like it.
double stained_share(const cv::Mat3b& picture);

/// Returns a warning if the colors of a picture are not those of a GelSight Mini, whose lamps make the top
/// bluish and the bottom reddish: other colors, swapped red and blue, or a picture upside down. A picture
/// that is mirrored left to right cannot be recognized. Returns "" if there is nothing to warn of, or if
/// `device_name` is another sensor. It is a part of judge_background() and throws like it.
std::string judge_lamps(const cv::Mat3b& mean, const std::string& device_name);

/// Returns the warning of judge_lamps() only if no imprint can have caused it: swapped red and blue, or a
/// picture upside down. Throws like judge_lamps().
std::string judge_orientation(const cv::Mat3b& mean, const std::string& device_name);

/// Throws Error for a background that cannot be used for a calibration, because printed dots cover too much
/// of the gel or judge_lamps() finds wrong colors. Other warnings are passed to `say_warning`. `name` is the
/// name of the background in messages.
void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_warning);

}  // namespace gelslam
