// Prepares a keyframe's surface as one observation of the signed distance field (Huang, Mirzaee, Kaess, Yuan,
// GelSLAM, T-RO 2026; Patch::read() evaluates it).
//
// Each pixel within the box of the contact has a height, a normal and a weight; heights and slopes are
// divided by the gradient scale that the pose graph found. The weight is a product of three factors:
// mask_weight() falls off at the contact's border, where the gel spans from the object to its rest position;
// nz², because the height of a steep slope is uncertain by 1/nz; and image_border_weight(), which fades the
// patch out at the image border. Pixels that were filled in weigh at most kUnreadWeight. The projective
// distance at a point is (h - z) nz, along the ray of the keyframe's camera.
//
// Moving a patch changes only its pose; the pixels are shared. Limitation: the weights do not account for
// errors of the pose or of the level of the heights, which blur the fused surface or duplicate it.

#include "patch.hpp"

#include <opencv2/imgproc.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam::fusion::detail {
namespace {

/// Upper limit of the weight of a pixel that was filled in from its surroundings. Such pixels close a hole
/// where no other touch shows the surface. Less kMinPixelWeight, the limit is above the viewer's
/// kSmoothBorder, so that the hole is closed in the live window, too.
constexpr float kUnreadWeight = 0.3f;
constexpr double kRimFadeMm = 0.25;    // l of mask_weight()
constexpr double kBeyondMm = 0.15;     // e of mask_weight()
constexpr double kBridgedMm = 0.35;    // Half of the length over which the gel returns to its rest position.
constexpr double kBorderFadeMm = 1.5;  // A tenth of the shorter side of a GelSight Mini's image.

/// Returns the distance from each pixel to the border of the mask, positive inside.
cv::Mat signed_distance_mm(const cv::Mat& mask, double pixel_pitch_mm) {
  cv::Mat inside, outside;
  cv::distanceTransform(mask, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(mask == 0, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return pixel_pitch_mm * (cv::max(inside - 0.5, 0) - cv::max(outside - 0.5, 0));
}

/// Returns sqrt(W) with W = (tanh((d + e)/l - 3) + 1)/2 for the pixels in `box`, which contains the contact.
/// d is the distance from the contact's border in mm, positive inside. Near the border the gel follows its
/// own rim and not the object (Huang et al., T-RO 2026, with e = 0). The root is taken because the contact
/// detected here ends before most of the rim begins; W itself would discard good observations and make the
/// mean noisier. The offset e compensates for the mesh ending 0.2 mm inside the area that has weight, as it
/// needs two voxels beyond its end; with e the mesh ends within a voxel of the contact's border. The gel
/// between two crests that are closer than twice kBridgedMm stays within a tenth of their depth, so it counts
/// as surface of the object.
cv::Mat1f mask_weight(const cv::Mat1b& contact, const cv::Rect& box, double pixel_pitch_mm) {
  // The margin is large enough that distances within it are the same as those computed over the whole image.
  const int margin = 1 + static_cast<int>(std::ceil(kBridgedMm / pixel_pitch_mm));
  const cv::Rect around = (box - cv::Point(margin, margin) + cv::Size(2 * margin, 2 * margin)) &
                          cv::Rect(cv::Point(), contact.size());
  cv::Mat1f distance_mm = signed_distance_mm(contact(around), pixel_pitch_mm);
  const cv::Mat closed_mm = signed_distance_mm(distance_mm > -kBridgedMm, pixel_pitch_mm) - kBridgedMm;
  cv::max(distance_mm, closed_mm, distance_mm);
  distance_mm = distance_mm(box - around.tl());
  for (float& d : distance_mm) {
    const double covered_mm = static_cast<double>(d) + kBeyondMm;
    d = covered_mm > 0 ? static_cast<float>(std::sqrt(0.5 * (std::tanh(covered_mm / kRimFadeMm - 3) + 1)))
                       : 0;
  }
  return distance_mm;
}

/// At the image border a patch is cut off without the gel having returned to rest. Fading it out there avoids
/// a step in the fused mean.
float image_border_weight(int u, int v, const cv::Size& size, double pixel_pitch_mm) {
  const auto rise = [&](int at, int length) {
    const int to_border = std::min(at, length - 1 - at);
    const float x = std::min(1.0f, static_cast<float>(to_border * pixel_pitch_mm / kBorderFadeMm));
    return x * x * (3.0f - 2.0f * x);
  };
  return rise(u, size.width) * rise(v, size.height);
}

}  // namespace

void check_patch(const PosedSurface& posed) {
  const std::string name = "keyframe " + std::to_string(posed.id);
  if (!posed.surface) throw Error("cannot fuse " + name + ": it has no surface");
  if (!posed.map_T_keyframe.matrix().allFinite())
    throw Error("cannot fuse " + name + ": its pose is not finite");
  if (!posed.surface.maps_agree())
    throw Error("cannot fuse " + name + ": its height, normal and contact maps differ in size");
  if (!(posed.surface.facts().pixel_pitch_mm > 0))
    throw Error("cannot fuse " + name + ": its pixel pitch is not positive");
}

void check_gradient_scale(double gradient_scale) {
  if (!(gradient_scale > 0) || !std::isfinite(gradient_scale))
    throw Error("the gradient scale has to be a positive number");
}

std::optional<Patch> Patch::prepare(const PosedSurface& posed, double gradient_scale) {
  check_patch(posed);
  const SurfacePtr unpacked = posed.surface.get();
  const Surface& s = *unpacked;
  if (s.contact.empty() || cv::countNonZero(s.contact) == 0) return std::nullopt;
  // One pixel more than has weight, so that the look-up of four neighbors stays inside the box.
  const int margin = 1 + static_cast<int>(std::ceil(kBeyondMm / s.pixel_pitch_mm));
  cv::Rect box = cv::boundingRect(s.contact);
  box = (box - cv::Point(margin, margin) + cv::Size(2 * margin, 2 * margin)) &
        cv::Rect(cv::Point(), s.contact.size());
  if (box.width < 2 || box.height < 2) return std::nullopt;

  Patch patch;
  patch.keyframe_ = posed.id;
  patch.box_ = box;
  patch.source_ = std::make_shared<Source>(posed.surface, gradient_scale);
  patch.inverse_pitch_ = static_cast<float>(1.0 / s.pixel_pitch_mm);
  patch.inverse_distance_ = static_cast<float>(s.optics.inverse_distance());
  const Eigen::Vector2d center_px = s.camera().center_px();
  patch.u_origin_ = static_cast<float>(center_px.x() - box.x);
  patch.v_origin_ = static_cast<float>(center_px.y() - box.y);
  patch.u_end_ = static_cast<float>(box.width - 1);
  patch.v_end_ = static_cast<float>(box.height - 1);
  patch.set_pose(posed.map_T_keyframe);
  return patch;
}

Patch::Pixels Patch::make_pixels(const Surface& s, const cv::Rect& box, double gradient_scale) {
  const cv::Mat1f weight = mask_weight(s.contact, box, s.pixel_pitch_mm);
  const float inverse_scale = static_cast<float>(1.0 / gradient_scale);
  Pixels pixels(static_cast<std::size_t>(box.area()));
  for (int v = 0; v < box.height; ++v) {
    for (int u = 0; u < box.width; ++u) {
      const cv::Point at(box.x + u, box.y + v);
      const cv::Vec3f& n = s.normals(at);
      const Eigen::Vector3f tilted =
          Eigen::Vector3f(n[0] * inverse_scale, n[1] * inverse_scale, n[2]).normalized();
      const float height_mm = s.height_mm(at) * inverse_scale;
      if (!tilted.allFinite() || !std::isfinite(height_mm)) continue;  // The weight stays 0.
      // The height of a steep slope is uncertain by 1/nz, so its information falls with nz².
      const float known = weight(v, u) * tilted.z() * tilted.z() *
                          image_border_weight(at.x, at.y, s.contact.size(), s.pixel_pitch_mm);
      pixels[static_cast<std::size_t>(v * box.width + u)] = {
          height_mm, std::min(known, is_read(s, at) ? 1.0f : kUnreadWeight), tilted.x(), tilted.y()};
    }
  }
  return pixels;
}

Patch Patch::opened() const {
  Patch patch = *this;
  patch.pixels_ = source_->pixels.get([this] {
    return std::make_shared<const Pixels>(
        make_pixels(*source_->surface.get(), box_, source_->gradient_scale));
  });
  return patch;
}

Patch Patch::moved_to(const Pose& map_T_keyframe) const {
  Patch patch = *this;
  patch.set_pose(map_T_keyframe);
  return patch;
}

void Patch::set_pose(const Pose& map_T_keyframe) {
  const Eigen::Matrix3d R = map_T_keyframe.linear();
  sensor_R_map_ = R.transpose().cast<float>();
  sensor_t_map_ = (-R.transpose() * map_T_keyframe.translation()).cast<float>();
  origin_ = map_T_keyframe.translation().cast<float>();
  x_axis_ = R.col(0).cast<float>();
  y_axis_ = R.col(1).cast<float>();
  z_axis_ = R.col(2).cast<float>();
}

}  // namespace gelslam::fusion::detail
