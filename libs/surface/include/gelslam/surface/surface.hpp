#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// Curvature is clipped to +- this, 1/mm: about the sharpest crease that a gel shows.
inline constexpr double kMaxCurvaturePerMm = 11.04;
/// The outermost gel of a contact spans from the object to the gel at rest and shows neither.
inline constexpr double kRimMm = 0.3;

/// Bounds that hold for any sensor.
inline constexpr double kMinPixelPitchMm = 0.001, kMaxPixelPitchMm = 1;

/// Says whether a sensor may have such pictures: sides of at most 4096 pixels and 200 mm. Files that say
/// otherwise are forged or damaged, and would take all memory.
bool is_possible_picture(cv::Size size, double pixel_pitch_mm);

/// What the gel's surface looks like in one frame. All maps are HxW, continuous, in the sensor frame:
/// x right, y down, z out of the gel toward the object, origin at the image center on the undeformed gel.
struct Surface {
  cv::Mat1f height_mm;  ///< of the gel at rest where nothing touches: 0, or its dome; lower in contact
  cv::Mat3f normals;    ///< unit, (-gx, -gy, 1) normalized; z > 0
  cv::Mat1b contact;    ///< 255 where the object touches, else 0
  /// Information of the normals as one byte per pixel. In contact, the variance of a slope is
  /// (kBestSlopeSigmaRad slope_sigma_ratio)² 255 / confidence (confidence_map(), lower_steep_confidence()),
  /// and confidence is at least 2. It is 1 where the picture does not show the object and normals were
  /// interpolated (is_read()), and 0 outside the contact. Empty: 255 all over the contact.
  cv::Mat1b confidence;
  /// Smoothed Laplacian of height (1/pixel), 0 outside the contact, clipped to +- kMaxCurvaturePerMm.
  cv::Mat1f curvature;
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics;  ///< of the camera that saw it; maps are on its rectified grid
  /// Standard deviation of the slopes at the best place of the gel, divided by kBestSlopeSigmaRad
  /// (slopes.hpp), that of a model which was trained on this sensor. At least 1; larger if the model states a
  /// larger one, or reads the bare gel as sloped.
  double slope_sigma_ratio = 1.0;
  /// Change of the read slopes by one gray level, divided by that of the models with which the limits in rad
  /// and mm were found. Limits on slopes and heights grow with it, as their noise does.
  double slope_noise_ratio = 1.0;
  int contact_pixels = 0;  ///< number of set pixels in `contact`
  /// Says that bare gel was seen, and has the heights of the gel at rest. Else heights are right among
  /// themselves only.
  bool zero_is_bare_gel = true;

  CameraModel camera() const { return {contact.size(), pixel_pitch_mm, optics}; }
  double contact_mm2() const { return contact_pixels * pixel_pitch_mm * pixel_pitch_mm; }
  /// Returns the point of the sensor frame that a pixel shows.
  Eigen::Vector3d point_mm(cv::Point pixel) const {
    return camera().point_mm(pixel, static_cast<double>(height_mm(pixel)));
  }
};

using SurfacePtr = std::shared_ptr<const Surface>;

/// Returns the information of the difference of two normals, given that of each: Surface::confidence over
/// 255, above 0. The variances 1/a and 1/b add up, and the variance at the best place counts once: with it
/// counted twice, poses of still pictures moved more often on real logs (docs/lab-notes.md).
inline float shared_confidence(float a, float b) { return a * b / (a + b - a * b); }

/// Distance of the points along rows and columns: dense enough to tell which patches overlap.
constexpr int kContactPointStepPx = 8;

/// Returns points of the contact on a coarse grid, in the sensor frame.
std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface);

/// Returns the middle of the contact, x and y in the sensor frame; the origin where there is none.
Eigen::Vector2d contact_center_mm(const Surface& surface);

/// Says whether a point of the sensor frame lies in the contact and close to its height (so not on the
/// object's other side).
bool shows(const Surface& surface, const Eigen::Vector3d& point_mm);

/// Read slope over true slope, along the sensor's x and along its y: networks trained on presses of balls err
/// by a few per cent, and not by the same along both.
struct GradientScale {
  double x = 1.0, y = 1.0;
  double mean() const { return 0.5 * (x + y); }
};

}  // namespace gelslam
