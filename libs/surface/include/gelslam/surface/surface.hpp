#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The curvature in Surface is limited to plus or minus this value in 1/mm, about that of the sharpest crease
/// that a gel can show.
inline constexpr double kMaxCurvaturePerMm = 11.04;
/// The width of the rim of a contact in mm. There the gel is draped: it spans from the object to the gel at
/// rest and shows the shape of neither.
inline constexpr double kRimMm = 0.3;

/// The limits of the pixel pitch in mm. They hold for any sensor.
inline constexpr double kMinPixelPitchMm = 0.001, kMaxPixelPitchMm = 1;

/// Returns whether a sensor can have such pictures: at least one pixel, sides of at most 4096 pixels and 200
/// mm, and a pixel pitch within its limits. A file that states another size is damaged or forged, and reading
/// it could take all memory.
bool is_possible_picture(cv::Size size, double pixel_pitch_mm);

/// The surface of the gel in one frame. All maps are HxW, continuous in memory, and on the rectified grid
/// (see CameraModel). Quantities are in the sensor frame: x to the right, y down, z out of the gel toward the
/// object; the origin is on the gel at rest in the middle of the picture.
struct Surface {
  cv::Mat1f height_mm;  ///< z in mm: 0 (or the dome) where the gel is at rest, lower in contact
  cv::Mat3f normals;    ///< unit normals (-gx, -gy, 1) / sqrt(1 + gx² + gy²), with z > 0
  cv::Mat1b contact;    ///< 255 where the object presses the gel down, else 0
  /// The information of each normal as one byte. In contact, the variance of a slope in rad² is
  /// (kBestSlopeSigmaRad slope_sigma_ratio)² 255 / confidence, and the confidence is 2 to 255 (see
  /// confidence_map() and lower_steep_confidence()). It is 1 in pixels of the contact whose normals were
  /// interpolated, because the picture does not show the object there (see is_read()), and 0 outside the
  /// contact. If the map is empty, the confidence is 255 in the whole contact.
  cv::Mat1b confidence;
  /// The smoothed Laplacian of the height in 1/pixel, limited to plus or minus kMaxCurvaturePerMm; 0 outside
  /// the contact.
  cv::Mat1f curvature;
  double pixel_pitch_mm = 0.0634;  ///< mm per pixel on the rectified grid
  SensorOptics optics;             ///< the optics of the camera that took the picture
  /// The standard deviation of the slopes at the best place of the gel, divided by kBestSlopeSigmaRad
  /// (slopes.hpp), that of a model which was trained on the same sensor. It is at least 1, and larger if the
  /// model states a larger uncertainty or reads the bare gel as sloped.
  double slope_sigma_ratio = 1.0;
  /// The change of the read slopes by one gray level, divided by that of a typical model, 0.0065. The noise
  /// of slopes and heights is proportional to it, so limits on them are multiplied by it.
  double slope_noise_ratio = 1.0;
  int contact_pixels = 0;  ///< the number of set pixels in `contact`
  /// True if bare gel was seen, so that heights are relative to the gel at rest. Otherwise heights have an
  /// unknown common offset.
  bool zero_is_bare_gel = true;

  CameraModel camera() const { return {contact.size(), pixel_pitch_mm, optics}; }
  double contact_mm2() const { return contact_pixels * pixel_pitch_mm * pixel_pitch_mm; }
  /// Returns the point of the sensor frame (mm) that a pixel shows.
  Eigen::Vector3d point_mm(cv::Point pixel) const {
    return camera().point_mm(pixel, static_cast<double>(height_mm(pixel)));
  }
};

using SurfacePtr = std::shared_ptr<const Surface>;

/// Returns the information of the difference between two normals, where a and b are the informations of the
/// normals (Surface::confidence divided by 255, above 0). Its inverse is 1/a + 1/b - 1: the variances of both
/// are added, but the variance at the best place of the gel is counted once. If it was counted twice, poses
/// of still pictures moved more often on real logs (docs/lab-notes.md).
inline float shared_confidence(float a, float b) { return a * b / (a + b - a * b); }

/// The distance in pixels between the points of coarse_contact_points_mm(). It is small enough to estimate
/// the overlap of contacts.
constexpr int kContactPointStepPx = 8;

/// Returns points of the contact on a coarse grid of pixels, in mm in the sensor frame.
std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface);

/// Returns the centroid of the contact's pixels, as x and y in mm in the sensor frame; (0, 0) if there is no
/// contact.
Eigen::Vector2d contact_center_mm(const Surface& surface);

/// Returns whether a point of the sensor frame (mm) appears in the contact, at a height that differs from
/// that of the surface by less than 0.5 mm. A point on the other side of the object does not.
bool shows(const Surface& surface, const Eigen::Vector3d& point_mm);

/// The read slope divided by the true slope, along x and along y of the sensor. Networks that were trained on
/// presses of balls err by some per cent, differently along the two axes.
struct GradientScale {
  double x = 1.0, y = 1.0;
  double mean() const { return 0.5 * (x + y); }
};

}  // namespace gelslam
