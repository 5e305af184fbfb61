#pragma once

#include <map>
#include <memory>
#include <string>
#include <tuple>

#include "gelslam/core/se3.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/shape.hpp"
#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::lab {

/// An object that is touched at one place, and again a little later in the same motion.
struct TouchSpec {
  std::string object = "pebble";
  int place = 0;         ///< Number of the place along the motion, less than kPlaces.
  double overlap = 0.8;  ///< Fraction of the first contact that the second one touches again, 0.05 .. 1.
  /// Additional motion of the object between the two touches, in the sensor's frame.
  Pose moved = Pose::Identity();
  double depth = 1.0;         ///< Factor on the indentation (ordinary_indentation_mm()).
  double texture = 1.0;       ///< Factor on the height of the object's texture.
  double noise_gain = 1.0;    ///< Factor on the camera's noise.
  double light_change = 0.0;  ///< Largest relative change of a color's brightness between the two touches.
  bool light_jumps = false;   ///< True: the light changes at once; false: by 2 % per frame.
  int grains = 0;             ///< Number of grains that have stuck to the gel since the background was taken.

  static constexpr int kPlaces = 4;
};

/// The surfaces computed from both images, with ground truth.
struct TouchPair {
  SurfacePtr reference, target;
  Pose reference_T_object = Pose::Identity(), target_T_object = Pose::Identity();
  double overlap = 0.0;  ///< From the true contacts of the gel.

  Pose target_T_reference() const { return target_T_object * reference_T_object.inverse(); }
};

/// Returns the usual indentation. Flat objects are pressed in less and are tilted by some degrees, because
/// pressed flat they leave no gel untouched from which the zero of the heights and the light could be
/// determined.
double ordinary_indentation_mm(ShapeKind kind);

/// Presses objects on the simulated sensor, renders images and computes surfaces as the program does. All
/// properties of a pair can be chosen, and its true pose is known. Objects roll and slide as a hand moves
/// them (motion "allover" of the simulator). Deterministic; not thread-safe, because it caches what it has
/// simulated. Throws Error.
class TouchStudio {
 public:
  /// `model` is the gradient model of the simulated sensor.
  explicit TouchStudio(GradientModel model);
  ~TouchStudio();

  TouchPair make(const TouchSpec& spec);

 private:
  struct Object;
  struct Camera;
  struct Press;

  const Object& object(const std::string& name, double texture);
  Press press(const TouchSpec& spec, int frame, const Pose& moved, const SensorGeometry& geometry);
  int frame_with_overlap(const TouchSpec& spec, int first);
  const Camera& camera(const TouchSpec& spec);

  GradientModel model_;
  SensorGeometry geometry_, coarse_;
  // Indexed by name and texture.
  std::map<std::pair<std::string, double>, std::unique_ptr<Object>> objects_;
  std::map<std::pair<double, int>, std::unique_ptr<Camera>> cameras_;  // Indexed by noise and grains.
  std::map<std::tuple<std::string, int, double, double, double>, int> second_frames_;
};

}  // namespace gelslam::lab
