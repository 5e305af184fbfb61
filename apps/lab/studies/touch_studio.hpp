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

/// An object touched at one place, and again a little later in the same motion.
struct TouchSpec {
  std::string object = "pebble";
  int place = 0;         ///< which one of kPlaces along the motion
  double overlap = 0.8;  ///< share of the first contact that the second one touches again, 0.05 .. 1
  /// of a pair: how the object moves besides between the two, in the sensor's frame
  Pose moved = Pose::Identity();
  double depth = 1.0;         ///< factor on how deep the deepest point is pressed: ordinary_indentation_mm
  double texture = 1.0;       ///< factor on the height of the object's texture
  double noise_gain = 1.0;    ///< factor on the camera's noise
  double light_change = 0.0;  ///< most by which a color gets brighter or darker between the two,
  bool light_jumps = false;   ///< at once, or by 2 % a frame
  int grains = 0;             ///< stuck to the gel since the background was taken

  static constexpr int kPlaces = 4;
};

/// What the program makes of the two pictures, and the truth.
struct TouchPair {
  SurfacePtr reference, target;
  Pose reference_T_object = Pose::Identity(), target_T_object = Pose::Identity();
  double overlap = 0.0;  ///< as pressed, by the true gels

  Pose target_T_reference() const { return target_T_object * reference_T_object.inverse(); }
};

/// Flat objects are pressed less, and are held tilted by some degrees: pressed flat, they leave no gel
/// untouched to read the zero of heights and the light from.
double ordinary_indentation_mm(ShapeKind kind);

/// Presses objects on the simulated sensor, takes pictures and reads them as the program would: everything
/// about a pair can be chosen, and its truth is known. Objects roll and slide as a hand moves them (the
/// simulator's "allover"). Deterministic; not thread-safe: it keeps what it has pressed. Throws Error.
class TouchStudio {
 public:
  /// `model`: of the simulated sensor.
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
  std::map<std::pair<std::string, double>, std::unique_ptr<Object>> objects_;  // by name and texture
  std::map<std::pair<double, int>, std::unique_ptr<Camera>> cameras_;          // by noise and grains
  std::map<std::tuple<std::string, int, double, double, double>, int> second_frames_;
};

}  // namespace gelslam::lab
