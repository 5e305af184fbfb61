#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/motion.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/sensor_geometry.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

struct ScanSpec {
  ShapeSpec object;
  MotionSpec motion;
  GelOptions gel;
  OpticsOptions optics;
  SensorGeometry geometry;
  int background_frames = 10;  ///< before the motion, nothing near
};

/// One picture and the truth about it.
struct SimulatedFrame {
  std::int64_t index = 0;  ///< in the log; background frames count
  double time_s = 0;
  cv::Mat3b bgr;
  cv::Mat1f height_mm;                      ///< true height of the gel
  cv::Mat1b contact;                        ///< 255 where gel and object touch
  cv::Mat2f slope;                          ///< true (dh/dx, dh/dy)
  Pose sensor_T_object = Pose::Identity();  ///< meaningless in background frames
  /// This frame's sensor in the sensor frame of the first contact, mm; nothing where nothing touches.
  std::optional<Pose> start_T_sensor;
};

/// A scan in memory. Every frame can be asked for in any order and from any thread; the same spec gives the
/// same pictures. Throws Error for parameters out of range, or when the object never touches the gel.
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
