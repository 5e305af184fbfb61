#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

struct MotionSpec {
  std::string name = "wobble";  ///< see motion_catalog()
  int frames = 245;             ///< Frames with the object near, not counting background frames.
  double speed = 1.0;           ///< factor on how far the hand moves, 0 .. 5
  double indentation_mm = 0.5;  ///< Approximate depth of the deepest point: 0.05 .. 1.5.
  double frame_rate_hz = 25.0;
  std::uint64_t seed = 1;
};

std::vector<CatalogEntry> motion_catalog();

/// Returns sensor_T_object for every frame (mm). The height of the object is adjusted so that its deepest
/// point over the sensor stays near the target indentation, smoothed over a few frames as by a hand; in the
/// first frames it is pressed in. At the end of a phase in which the object is lifted, it is clear of the
/// gel. Deterministic. Throws Error for an unknown name or parameters out of range. `surface` is the object's
/// mesh with edges of a millimeter or less.
std::vector<Pose> make_motion(const MotionSpec& spec, const Shape& shape, const Mesh& surface,
                              const SensorGeometry& geometry);

struct ScanSpec {
  ShapeSpec object;
  MotionSpec motion;
  OpticsOptions optics;
  SensorGeometry geometry;
  int background_frames = 10;  ///< Frames before the motion, without any object near.
};

/// An image with its ground truth.
struct SimulatedFrame {
  std::int64_t index = 0;  ///< Index in the log, in which background frames count.
  double time_s = 0;
  cv::Mat3b bgr;
  cv::Mat1f height_mm;                      ///< true height of the gel, on the grid of the geometry
  cv::Mat1b contact;                        ///< On the same grid: 255 where gel and object touch.
  cv::Mat2f slope;                          ///< On the same grid: true (dh/dx, dh/dy).
  Pose sensor_T_object = Pose::Identity();  ///< meaningless in background frames
  /// Pose of the sensor in the sensor frame of the first contact (mm); nothing without contact.
  std::optional<Pose> start_T_sensor;
};

/// A simulated scan. Frames can be requested in any order and from any thread; the same spec gives the same
/// images. Throws Error for parameters out of range, or when the object never touches the gel.
class Simulator {
 public:
  explicit Simulator(const ScanSpec& spec);

  int frame_count() const { return spec_.background_frames + static_cast<int>(sensor_T_object_.size()); }
  SimulatedFrame frame(int index) const;

  const ScanSpec& spec() const { return spec_; }
  const Shape& shape() const { return *shape_; }
  /// The object's surface, object frame, millimeters.
  const Mesh& surface() const { return surface_; }
  int contact_start_frame() const { return contact_start_frame_; }
  const Pose& start_T_object() const { return start_T_object_; }

 private:
  ScanSpec spec_;
  ShapePtr shape_;
  Mesh surface_;
  Optics optics_;
  std::vector<Pose> sensor_T_object_;
  int contact_start_frame_ = 0;
  Pose start_T_object_ = Pose::Identity();
};

}  // namespace gelslam
