#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The properties of a surface that can be known without unpacking its maps. The members mean the same as in
/// Surface.
struct SurfaceFacts {
  cv::Size size;  ///< width and height of the maps in pixels
  double pixel_pitch_mm = 0;
  double slope_sigma_ratio = 1;
  int contact_pixels = 0;
  Eigen::Vector2d contact_center_mm = Eigen::Vector2d::Zero();  ///< see contact_center_mm() in surface.hpp
  double contact_mm2() const { return contact_pixels * pixel_pitch_mm * pixel_pitch_mm; }
};
SurfaceFacts facts_of(const Surface& surface);

/// A compressed surface, about 25 times smaller than a Surface, as it is kept in memory and in files. It has
/// every pixel in the bounding box of the contact, and means over 4x4 pixels outside it, where the gel is
/// smooth. The values are quantized and then compressed without loss. Normals are rounded to kNormalStep, a
/// hundredth of their noise (0.02 rad), and heights to kHeightStepMm, a thirtieth of theirs (0.004 mm). The
/// step of the curvature, kCurvatureStep, is so small that few pixels become equal, because the registration
/// chooses its samples by the rank of their curvature. Packing an unpacked surface gives the same bytes.
/// Objects are immutable, cheap to copy, and can be shared between threads. docs/file-formats.md describes
/// the layout.
class PackedSurface {
 public:
  static constexpr float kNormalStep = 1.0F / 4096;
  static constexpr float kHeightStepMm = 1.0F / 8192;
  static constexpr float kCurvatureStep = 1.0F / 32768;
  static constexpr float kCoarseNormalStep = 1.0F / 1024;    ///< outside the bounding box of the contact
  static constexpr float kCoarseHeightStepMm = 1.0F / 2048;  ///< outside the bounding box of the contact
  /// Returns a height in multiples of kHeightStepMm, rounded.
  static std::int16_t height_steps(float height_mm);

  explicit PackedSurface(const Surface& surface);
  /// Returns the surface whose bytes() are given. Throws Error if they are damaged.
  static PackedSurface from_bytes(std::string bytes);

  const std::string& bytes() const { return *bytes_; }
  /// Returns the surface with its maps, which takes some milliseconds. Throws Error if the contents are
  /// impossible for a surface.
  SurfacePtr unpack() const;

  const SurfaceFacts& facts() const { return facts_; }

 private:
  explicit PackedSurface(std::string bytes);

  SurfaceFacts facts_;
  std::shared_ptr<const std::string> bytes_;
};

}  // namespace gelslam
