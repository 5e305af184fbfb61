#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Holds what is known of a surface without its maps.
struct SurfaceFacts {
  cv::Size size;
  double pixel_pitch_mm = 0;
  double slope_sigma_ratio = 1;
  int contact_pixels = 0;
  Eigen::Vector2d contact_center_mm = Eigen::Vector2d::Zero();
};
SurfaceFacts facts_of(const Surface& surface);

/// A surface as maps keep it in memory and in files. It has every pixel of the contact's bounding box, and
/// means over 4x4 pixels outside it, where the gel is smooth. Values are quantized, then compressed without
/// loss, with a checksum. About 25 times smaller than a Surface. Normals are rounded to kNormalStep, a
/// hundredth of their noise (0.02 rad), heights to kHeightStepMm, a thirtieth (0.004 mm). Curvature is
/// rounded to kCurvatureStep. This step is so small that few pixels become equal, because registration
/// chooses its samples by the rank of their curvature. Packing what was unpacked gives the same bytes.
/// Immutable, cheap to copy, shareable between threads. Layout: docs/file-formats.md.
class PackedSurface {
 public:
  static constexpr float kNormalStep = 1.0F / 4096;
  static constexpr float kHeightStepMm = 1.0F / 8192;
  static constexpr float kCurvatureStep = 1.0F / 32768;
  static constexpr float kCoarseNormalStep = 1.0F / 1024;  ///< beyond the contact's box
  static constexpr float kCoarseHeightStepMm = 1.0F / 2048;
  static std::int16_t height_steps(float height_mm);  ///< rounded to kHeightStepMm

  explicit PackedSurface(const Surface& surface);
  /// What bytes() gave. Throws Error when it is damaged.
  static PackedSurface from_bytes(std::string bytes);

  const std::string& bytes() const { return *bytes_; }
  /// Deterministic; takes some milliseconds. Throws Error for contents that no surface has.
  SurfacePtr unpack() const;

  const SurfaceFacts& facts() const { return facts_; }

 private:
  explicit PackedSurface(std::string bytes);

  SurfaceFacts facts_;
  std::shared_ptr<const std::string> bytes_;
};

}  // namespace gelslam
