#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

struct CollectorOptions {
  double diameter_mm = 0.0;  ///< of the ball
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics{};        ///< of the sensor
  bool any_background = false;  ///< take the first still frames as background whatever they show
};

/// The state of a touch, as far as the gel shows it.
enum class CollectPhase {
  background,  ///< the bare gel is being looked at; nothing may touch it
  ready,       ///< nothing touches the gel
  pressing,    ///< something touches it, and no good press has been seen yet
  taken,       ///< a good press of this touch is kept; lift the ball
};

/// A ball held still on the gel, well seen.
struct CollectedPress {
  cv::Mat3b bgr;         ///< mean of the frames in which it was held
  ContactCircle circle;  ///< a label
  double confidence = 0.0;
};

struct CollectorStatus {
  CollectPhase phase = CollectPhase::background;
  std::string warning;                 ///< what is wrong with this touch or this gel, for people, or ""
  std::optional<ContactCircle> found;  ///< the circle last found in this touch, good or not
};

/// Watches a sensor's pictures in order and takes the best press of every touch when the ball is lifted. It
/// uses no clock, files or camera. Warns of presses that are too deep, too shallow, too near the edge,
/// sliding, of two contacts, and of a light that changed.
class PressCollector {
 public:
  explicit PressCollector(const CollectorOptions& options);
  ~PressCollector();

  /// The next picture; a press when this picture ended a good touch. Throws Error when it has another size
  /// than the first, or is smaller than 80x32 pixels.
  std::optional<CollectedPress> add(const cv::Mat3b& bgr);
  /// To be called after the last picture; returns the press that is still held, if it is good.
  std::optional<CollectedPress> finish();

  const CollectorStatus& status() const;
  /// The bare gel: the mean of the first frames in which it was still and bare. Empty until they have been
  /// seen.
  const cv::Mat3b& background() const;
  /// Presses from here on are compared with this picture of the same gel instead (an earlier session's).
  /// Throws Error on another size.
  void set_background(const cv::Mat3b& background);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
