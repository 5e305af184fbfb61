#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "gelslam/core/se3.hpp"
#include "gelslam/simulation/sensor_geometry.hpp"
#include "gelslam/simulation/shape.hpp"

namespace gelslam {

/// The gel: a membrane under tension on an elastic foundation (Pasternak's model).
struct GelOptions {
  /// Length over which the membrane rim around a contact decays: sqrt(tension / foundation stiffness). It
  /// also limits how far the gel follows into pits: a surface hollower than |height| / length^2 is bridged.
  double relaxation_length_mm = 0.35;
  double max_indentation_mm = 3.0;  ///< deeper parts of the object are cut off here
};

struct GelShape {
  cv::Mat1f height_mm;  ///< HxW, 0 untouched, negative where pushed in; never above the object
  cv::Mat1b contact;    ///< 255 where gel and object touch
  cv::Mat2f slope;      ///< HxW, (dh/dx, dh/dy), dimensionless
};

/// The gel at rest.
GelShape flat_gel(const SensorGeometry& geometry);

/// Lowest surface of the object above each pixel: z in mm in the sensor frame, +infinity where the object is
/// higher than `z_max_mm` or absent. Parts below -max_indentation_mm are clamped to it.
cv::Mat1f object_underside(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry,
                           const GelOptions& options);

/// Moves the object along the sensor's z until its deepest point over the view is so deep. Nothing when
/// that is not possible.
std::optional<Pose> settle_object(const Shape& shape, Pose sensor_T_object, double indentation_mm,
                                  const SensorGeometry& geometry, const GelOptions& options);

/// Deforms the gel: minimises tension/2 |grad h|^2 + stiffness/2 h^2 subject to h <= underside (an obstacle
/// problem; coarse-to-fine, projected SOR), free borders. Throws Error on a size that does not fit or options
/// out of range.
GelShape press_gel(const cv::Mat1f& underside_mm, const SensorGeometry& geometry, const GelOptions& options);

/// Both together, for a gel that reaches a millimeter beyond the view on every side, as a real one does.
GelShape press_object(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry,
                      const GelOptions& options);

}  // namespace gelslam
