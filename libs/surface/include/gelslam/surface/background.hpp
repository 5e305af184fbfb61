#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {

/// Mean of images of one size, rounded to the nearest gray level. Throws Error when there are none or sizes
/// differ.
cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images);

/// Mean of pictures of the bare gel, each scaled per channel to the brightness of the last where they differ
/// by more than a hundredth: a camera's exposure may still settle in the first of them. Throws like
/// mean_image.
cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames);

/// Dots printed on a gel, by which other programs measure shear. Slopes cannot be read through them.
struct MarkerDots {
  int count = 0;
  double spacing_px = 0.0, diameter_px = 0.0;
  /// For the user: "the gel has markers (63 dots, 32 pixels apart), ... : use a gel without markers".
  std::string sentence() const;
};

/// Finds markers in a picture of the bare gel (own): at least nine dark round spots of one size at similar
/// distances from their nearest neighbors. Dirt is irregular and not taken for them. Nothing when there are
/// none, or the picture is smaller than 32 pixels.
std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background);

struct BackgroundCheck {
  bool contact = false;
  bool markers = false;  ///< on the gel: slopes cannot be read, touched or not
  std::string reason;    ///< for the user; empty when there is neither
};

/// Whether pictures that should show the bare gel show contact (own): something moves between them, or the
/// gel has markers (find_marker_dots), or the model reads an imprint in their background_image (slopes or
/// curvature that are steep locally; the bare gel shows at most a smooth bias). A flat object that does not
/// move cannot be told from bare gel. Throws Error like mean_image, and when the model does not fit.
BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options);

/// What makes a picture of the bare gel doubtful, as sentences for the user (own): too dark, saturated,
/// without color, markers, dirt or a tear, and judge_lamps. With `model` also a bare gel that the model reads
/// as sloped: another sensor's model, another gel, another exposure. Contact is check_background's job. The
/// limits lie well apart from four real sensors' backgrounds. Throws Error when the picture is smaller than
/// 32 pixels.
std::vector<std::string> judge_background(const cv::Mat3b& mean, const std::string& device_name,
                                          const GradientModel* model = nullptr);

/// The part of judge_background about the lamps of a GelSight Mini, which make the top bluish and the bottom
/// reddish: other colors, red and blue swapped, the picture upside down. A picture mirrored left to right
/// looks the same. "" for other sensors. Throws Error when the picture is smaller than 32 pixels.
std::string judge_lamps(const cv::Mat3b& mean, const std::string& device_name);

/// Throws Error for a background that no calibration can use: a gel with markers, red and blue swapped. Other
/// doubts are reported by `say_doubt`. `name`: of the background, for messages.
void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_doubt);

}  // namespace gelslam
