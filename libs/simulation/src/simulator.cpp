// Simulates a scan: an object moves over the gel along a given motion. For each frame, press_object()
// computes the shape of the gel, and Optics renders the picture that the camera sees of it. The truth of a
// frame is the pose of the sensor, relative to the first frame with contact, and the shape of the gel.

#include "gelslam/simulation/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

// The number of vertices of the object's surface. They suffice to determine how the object rests on the
// sensor, and to compare meshes with it.
constexpr double kSurfacePoints = 60'000;

/// Returns the edge length at which the object's surface has about `kSurfacePoints` vertices, 0.08 to 0.4 mm.
float surface_spacing_mm(const Shape& shape) {
  const Eigen::Vector3d size = shape.bounds_mm().sizes().cast<double>();
  const double area = 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  return static_cast<float>(std::clamp(std::sqrt(area / kSurfacePoints), 0.08, 0.4));
}

void check(const ScanSpec& spec) {
  if (spec.background_frames < 1 || spec.background_frames > 1000)
    throw Error("number of background frames must be between 1 and 1000");
  const SensorGeometry& geometry = spec.geometry;
  if (!(geometry.pixel_pitch_mm > 1e-3 && geometry.pixel_pitch_mm < 1))
    throw Error("pixel pitch must be between 0.001 and 1 mm");
  for (const int size : {geometry.width_px, geometry.height_px})
    if (size < 16 || size > 4096)
      throw Error("simulated pictures must be between 16 and 4096 pixels wide and high");
}

bool touches(const GelShape& gel) { return cv::countNonZero(gel.contact) > 0; }

}  // namespace

Simulator::Simulator(const ScanSpec& spec)
    : spec_((check(spec), spec)),
      shape_(make_shape(spec.object)),
      surface_(shape_->mesh(surface_spacing_mm(*shape_))),
      optics_(spec.geometry, spec.optics),
      sensor_T_object_(make_motion(spec.motion, *shape_, surface_, spec.geometry)) {
  // Finds the first frame with contact.
  for (std::size_t k = 0; k < sensor_T_object_.size(); ++k) {
    if (!touches(press_object(*shape_, sensor_T_object_[k], optics_.gel_grid()))) continue;
    contact_start_frame_ = spec_.background_frames + static_cast<int>(k);
    start_T_object_ = sensor_T_object_[k];
    return;
  }
  throw Error("the simulated object never touches the gel");
}

SimulatedFrame Simulator::frame(int index) const {
  if (index < 0 || index >= frame_count()) throw Error("no such simulated frame");
  SimulatedFrame frame;
  frame.index = index;
  frame.time_s = index / spec_.motion.frame_rate_hz;
  const bool background = index < spec_.background_frames;
  GelShape gel;
  if (background) {
    gel = gel_at_rest(optics_.gel_grid());
  } else {
    frame.sensor_T_object = sensor_T_object_[static_cast<std::size_t>(index - spec_.background_frames)];
    gel = press_object(*shape_, frame.sensor_T_object, optics_.gel_grid());
    if (touches(gel)) frame.start_T_sensor = start_T_object_ * frame.sensor_T_object.inverse();
  }
  frame.bgr = optics_.render(gel, index, !background);
  // The grid of the gel is larger than the picture if the lens sees more. The truth is cropped to the
  // picture.
  const SensorGeometry& grid = optics_.gel_grid();
  const cv::Rect view((grid.width_px - spec_.geometry.width_px) / 2,
                      (grid.height_px - spec_.geometry.height_px) / 2, spec_.geometry.width_px,
                      spec_.geometry.height_px);
  frame.height_mm = gel.height_mm(view).clone();
  frame.contact = gel.contact(view).clone();
  frame.slope = gel.slope(view).clone();
  return frame;
}

}  // namespace gelslam
