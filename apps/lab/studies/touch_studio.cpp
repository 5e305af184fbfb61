#include "touch_studio.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "simulated_frames.hpp"

namespace gelslam::lab {
namespace {

// Length of the motion from which touches and their successors are taken.
constexpr int kStudioFrames = 1000;
constexpr float kMeshSpacingMm = 0.5F;  // Enough to determine how an object rests on the sensor.
constexpr int kCoarser = 2;             // Factor of the pixel size on which overlaps are searched.
constexpr double kFlatTiltRad = 0.03;
constexpr double kDriftPerFrame = 0.02;

SensorGeometry coarser(const SensorGeometry& geometry, int factor) {
  return {geometry.width_px / factor, geometry.height_px / factor, geometry.pixel_pitch_mm * factor};
}

MotionSpec motion_all_over() {
  MotionSpec motion;
  motion.name = "allover";
  motion.frames = kStudioFrames;
  return motion;
}

/// Returns factors for blue, green and red: each lamp changes separately, one of them by `most`.
cv::Scalar light_factors(double most, int place) {
  std::mt19937_64 random(static_cast<std::uint64_t>(place));
  cv::Scalar factors;
  for (int c = 0; c < 3; ++c) factors[c] = 1 + most * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1);
  factors[place % 3] = place % 2 == 0 ? 1 + most : 1 - most;
  return factors;
}

cv::Mat3b relit(const cv::Mat3b& picture, const cv::Scalar& factors) {
  cv::Mat3b result;
  cv::multiply(picture, factors, result);
  return result;
}

/// Computes the surface of the target under changed light. If the light drifts, the reference under
/// intermediate light is processed first.
SurfacePtr estimate_relit(SurfaceEstimator& estimator, const TouchSpec& spec, const cv::Mat3b& reference,
                          const cv::Mat3b& target) {
  if (spec.light_change == 0) return estimator.estimate(target);
  const int steps = spec.light_jumps ? 1 : static_cast<int>(std::ceil(spec.light_change / kDriftPerFrame));
  for (int step = 1; step < steps; ++step)
    estimator.estimate(relit(reference, light_factors(spec.light_change * step / steps, spec.place)));
  return estimator.estimate(relit(target, light_factors(spec.light_change, spec.place)));
}

/// Uses the first half of the motion, so that the other half remains for the second touches; odd numbers
/// avoid symmetries of the motion.
int first_frame(const TouchSpec& spec) {
  if (spec.place < 0 || spec.place >= TouchSpec::kPlaces) throw Error("there is no such place");
  return 30 + spec.place * 117;
}

/// Returns the tilt of the whole motion: flat objects are tilted in another direction at each place.
Pose held(int place, ShapeKind kind) {
  Pose tilt = Pose::Identity();
  if (kind != ShapeKind::flat) return tilt;
  const double side = 0.5 + 2 * M_PI * place / TouchSpec::kPlaces;
  tilt.rotate(Eigen::AngleAxisd(kFlatTiltRad, Eigen::Vector3d(std::cos(side), std::sin(side), 0)));
  return tilt;
}

/// Returns the fraction of the reference's contact that coincides with the target's contact at the given
/// pose.
double contact_overlap(const GelShape& reference, const GelShape& target, const Pose& target_T_reference,
                       const SensorGeometry& geometry) {
  int all = 0, shared = 0;
  for (int v = 0; v < geometry.height_px; ++v)
    for (int u = 0; u < geometry.width_px; ++u) {
      if (reference.contact(v, u) == 0) continue;
      ++all;
      const Eigen::Vector3d p =
          target_T_reference * Eigen::Vector3d(geometry.x_mm(u), geometry.y_mm(v), reference.height_mm(v, u));
      const auto tu =
          static_cast<int>(std::lround(p.x() / geometry.pixel_pitch_mm + 0.5 * geometry.width_px - 0.5));
      const auto tv =
          static_cast<int>(std::lround(p.y() / geometry.pixel_pitch_mm + 0.5 * geometry.height_px - 0.5));
      if (tu < 0 || tv < 0 || tu >= geometry.width_px || tv >= geometry.height_px) continue;
      shared += target.contact(tv, tu) != 0 ? 1 : 0;
    }
  return all == 0 ? 0.0 : static_cast<double>(shared) / all;
}

}  // namespace

double ordinary_indentation_mm(ShapeKind kind) { return kind == ShapeKind::flat ? 0.35 : 0.7; }

struct TouchStudio::Object {
  ShapePtr shape;
  std::vector<Pose> sensor_T_object;  ///< Of the whole motion.
};

struct TouchStudio::Press {
  Pose sensor_T_object = Pose::Identity();
  GelShape gel;
};

/// The camera under given conditions, with its image before contact.
struct TouchStudio::Camera {
  Optics optics;
  cv::Mat3b background;
};

TouchStudio::TouchStudio(GradientModel model)
    : model_(std::move(model)), coarse_(coarser(geometry_, kCoarser)) {}
TouchStudio::~TouchStudio() = default;

const TouchStudio::Object& TouchStudio::object(const std::string& name, double texture) {
  std::unique_ptr<Object>& kept = objects_[{name, texture}];
  if (!kept) {
    auto object = std::make_unique<Object>();
    ShapeSpec spec;
    spec.name = name;
    spec.texture = texture;
    object->shape = make_shape(spec);
    // The poses are the same for any texture, so that only the texture differs.
    if (texture == 1.0)
      object->sensor_T_object =
          make_motion(motion_all_over(), *object->shape, object->shape->mesh(kMeshSpacingMm), geometry_);
    else
      object->sensor_T_object = this->object(name, 1.0).sensor_T_object;
    kept = std::move(object);
  }
  return *kept;
}

TouchStudio::Press TouchStudio::press(const TouchSpec& spec, int frame, const Pose& moved,
                                      const SensorGeometry& geometry) {
  const Object& touched = object(spec.object, spec.texture);
  const double indentation_mm = spec.depth * ordinary_indentation_mm(touched.shape->kind());
  const Pose there = moved * held(spec.place, touched.shape->kind()) *
                     touched.sensor_T_object.at(static_cast<std::size_t>(frame));
  const std::optional<Pose> pose = settle_object(*touched.shape, there, indentation_mm, geometry_);
  if (!pose) throw Error("the object cannot be laid on the gel");
  return {*pose, press_object(*touched.shape, *pose, geometry)};
}

/// Finds the frame with the wanted overlap. The overlap decreases over time until the object comes back, so
/// the search starts at the first frame.
int TouchStudio::frame_with_overlap(const TouchSpec& spec, int first) {
  if (spec.overlap >= 1) return first;
  const auto [known, is_new] =
      second_frames_.try_emplace({spec.object, spec.place, spec.overlap, spec.depth, spec.texture}, first);
  if (!is_new) return known->second;
  const Press reference = press(spec, first, Pose::Identity(), coarse_);
  const auto excess = [&](int second) {
    const Press target = press(spec, second, Pose::Identity(), coarse_);
    return contact_overlap(reference.gel, target.gel,
                           target.sensor_T_object * reference.sensor_T_object.inverse(), coarse_) -
           spec.overlap;
  };
  int near = first, far = first + 1;
  double near_excess = 1 - spec.overlap, far_excess = excess(far);
  while (far_excess > 0) {
    if (far == kStudioFrames - 1)
      throw Error("object '" + spec.object + "' never overlaps as little as " + std::to_string(spec.overlap));
    near = far;
    near_excess = far_excess;
    far = std::min(first + 2 * (far - first), kStudioFrames - 1);
    far_excess = excess(far);
  }
  while (far - near > 1) {
    const int middle = (near + far) / 2;
    const double middle_excess = excess(middle);
    (middle_excess > 0 ? near : far) = middle;
    (middle_excess > 0 ? near_excess : far_excess) = middle_excess;
  }
  return known->second = near_excess < -far_excess ? near : far;
}

const TouchStudio::Camera& TouchStudio::camera(const TouchSpec& spec) {
  std::unique_ptr<Camera>& kept = cameras_[{spec.noise_gain, spec.grains}];
  if (!kept) {
    OpticsOptions options;
    options.noise_gain = spec.noise_gain;
    options.dirt = spec.grains > 0;
    options.late_grains = spec.grains;
    const Optics optics(geometry_, options);
    kept = std::make_unique<Camera>(Camera{optics, bare_gel(optics)});
  }
  return *kept;
}

TouchPair TouchStudio::make(const TouchSpec& spec) {
  const int first = first_frame(spec);
  const int second = frame_with_overlap(spec, first);
  const Press reference = press(spec, first, Pose::Identity(), geometry_),
              target = press(spec, second, spec.moved, geometry_);
  const Camera& seen_by = camera(spec);
  TouchPair pair;
  pair.reference_T_object = reference.sensor_T_object;
  pair.target_T_object = target.sensor_T_object;
  pair.overlap = contact_overlap(reference.gel, target.gel, pair.target_T_reference(), geometry_);
  SurfaceEstimator estimator(model_, seen_by.background, SurfaceOptions{});
  // Two images do not share their noise, and different places share neither noise nor light.
  const std::int64_t picture = 2 * spec.place;
  const cv::Mat3b first_picture = seen_by.optics.render(reference.gel, picture, true);
  pair.reference = estimator.estimate(first_picture);
  pair.target =
      estimate_relit(estimator, spec, first_picture, seen_by.optics.render(target.gel, picture + 1, true));
  return pair;
}

}  // namespace gelslam::lab
