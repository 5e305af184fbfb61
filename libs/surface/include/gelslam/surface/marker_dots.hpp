#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace gelslam {

/// Dots printed on a gel, by which other programs measure shear. Slopes cannot be read through them.
struct MarkerDots {
  int count = 0;
  double spacing_px = 0.0, diameter_px = 0.0;
  /// For people: "the gel has markers (63 dots, 32 pixels apart), ... : use a gel without markers".
  std::string sentence() const;
};

/// Finds markers in a picture of the bare gel (own): at least nine dark round spots of one size whose
/// distances to the nearest one are alike. Dirt, which lies anyhow, is not taken for them. Nothing when there
/// are none, or the picture is smaller than 32 pixels.
std::optional<MarkerDots> find_marker_dots(const cv::Mat3b& background);

}  // namespace gelslam
