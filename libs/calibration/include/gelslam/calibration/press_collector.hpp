#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

struct CollectorOptions {
  double diameter_mm = 0.0;  ///< Diameter of the ball.
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics{};  ///< of the sensor
  /// Use the first frames without motion as background even if they seem to show contact.
  bool any_background = false;
};

/// State of the current touch, as far as it can be seen.
enum class CollectPhase {
  background,  ///< The bare gel is being recorded; nothing may touch it.
  ready,       ///< nothing touches the gel
  pressing,    ///< Something touches the gel, and no good press has been seen yet.
  taken,       ///< A good press of this touch was stored; the ball can be lifted.
};

/// The image of a ball that is held still on the gel.
struct CollectedPress {
  cv::Mat3b bgr;         ///< Mean of the frames in which the ball was held still.
  ContactCircle circle;  ///< Found circle, to be used as a label.
  double confidence = 0.0;
};

struct CollectorStatus {
  CollectPhase phase = CollectPhase::background;
  std::string warning;  ///< Problem with this touch or this gel as a sentence for the user, or "".
  std::optional<ContactCircle> found;  ///< Circle found last in this touch, whether good or not.
};

/// Watches the images of a sensor in order and returns the best press of each touch when the ball is lifted.
/// Uses no clock, files or camera. Warns if a press is too deep, too shallow, too near the border or sliding,
/// if there are two contacts, and if the light has changed.
class PressCollector {
 public:
  explicit PressCollector(const CollectorOptions& options);
  ~PressCollector();

  /// Processes the next image. Returns a press if this image ended a good touch. Throws Error when the image
  /// differs in size from the first one, or is smaller than 80x32 pixels.
  std::optional<CollectedPress> add(const cv::Mat3b& bgr);
  /// To be called after the last image. Returns the press that is still held, if it is good.
  std::optional<CollectedPress> finish();

  const CollectorStatus& status() const;
  /// Returns the mean of the first frames that showed the gel still and without contact; empty before.
  const cv::Mat3b& background() const;
  /// Replaces the background by an earlier image of the same gel; later presses are compared with it. Throws
  /// Error if its size differs.
  void set_background(const cv::Mat3b& background);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
