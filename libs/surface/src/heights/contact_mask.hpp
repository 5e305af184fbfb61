#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// Over which the gel's membrane rim decays around a contact.
inline constexpr double kRimLengthMm = 1.4;

/// The box with a margin, within the image; an empty one stays empty.
cv::Rect grown(const cv::Rect& box, int margin, cv::Size image);

/// Where something presses on the gel, as opposed to the membrane rim, where the gel only hangs between what
/// presses and the rest (own). The gel is modeled as a stretched membrane on an elastic foundation: pressure
/// is proportional to d - λ² Δd for a depth d. It vanishes on a membrane rim (which decays with the length
/// λ), equals d under a flat face, and exceeds d under a convex one. A place is pressed where the pressure is
/// more than half of d, on a scale of about half a millimeter: finer texture belongs to the object and must
/// not tear holes into its mask.
class PressureMap {
 public:
  /// Clears the pixels of `mask` (HxW, 0 or 255) where nothing presses on the gel. `height_mm`: HxW, 0 on the
  /// untouched gel, negative in contact.
  void keep_pressed(const cv::Mat1f& height_mm, double pixel_pitch_mm, cv::Mat1b& mask);

 private:
  cv::Mat1f depth_, padded_, laplacian_, excess_, excess_px_;
  cv::Mat1b pressed_;
};

struct ContactRule {
  double color_dist_threshold = 15.0;  ///< gray levels
  double height_threshold_mm = 0.2;    ///< for deep contacts
  double slope_noise = 1;              ///< Surface::slope_noise
};

/// Contact by depth and pressure, confirmed by color (own; the public rule does not see contact above
/// height_threshold_mm, cuts out what lies flat, and takes the gel's membrane rim for the object). A pixel
/// touches where it lies below a limit that follows the frame's depth (0.3 of the deepest place, at most
/// height_threshold_mm, or 0.25 of the deepest place if that is more, at least what noise reaches) and where
/// the gel is pressed (PressureMap). A connected piece counts only if its color differs somewhere by
/// color_dist_threshold (in proportion less when shallow).
class ContactDetector {
 public:
  ContactDetector(cv::Size size, const ContactRule& rule);

  /// `height_mm`: 0 on the untouched gel; `scatter_mm`: of the untouched gel; `block_difference`: mean color
  /// difference of 4x4 blocks. Fills `contact` (HxW, 0 or 255).
  void detect(const cv::Mat1f& height_mm, double pixel_pitch_mm, float scatter_mm,
              const cv::Mat3f& block_difference, cv::Mat1b& contact);

  /// Blocks that hold contact, of the last detect().
  const cv::Mat1b& contact_blocks() const { return blocks_; }

 private:
  /// Only gaps with contact on both sides within the picture: at its border a plain closing would continue
  /// the outline straight ahead, in steps that no object has.
  void close_gaps(cv::Mat1b& contact);
  /// Flat fields between raised parts are hardly pressed, but touched: small holes that are deep enough are
  /// filled. `below`: where they are; a hole that reaches the border of `contact` is open.
  void fill_small_holes(const cv::Mat1b& below, cv::Mat1b& contact);
  double depth_limit_mm(const cv::Mat1f& height_mm, float scatter_mm);
  void keep_colored_pieces(const cv::Mat3f& block_difference, double color_threshold, cv::Mat1b& contact);

  ContactRule rule_;
  PressureMap pressure_;
  int half_gap_px_;
  cv::Mat gap_;
  cv::Mat1b below_, closed_, blocks_, keep_;
  cv::Mat1b holes_;
  cv::Mat1i labels_;
  std::vector<int> area_px_;  // of each hole
  std::vector<float> scratch_;
};

}  // namespace gelslam::surface::detail
