// Prepares a keyframe's surface as one observation of the signed distance field (Huang, Mirzaee, Kaess, Yuan,
// GelSLAM, T-RO 2026; Patch::read() evaluates it).
//
// Each pixel within the box of the contact keeps its height, its normal and a weight; all heights and slopes
// are divided by the gradient scale that the pose graph found. The weight is a product: mask_weight() falls
// off at the contact's border, where the gel spans from the object to rest; nz² because a steep slope's
// height is uncertain by 1/nz; and image_border_weight() fades the patch out where the picture cuts it off.
// Pixels that were filled in weigh at most kUnreadWeight. The projective distance at a point is (h - z) nz,
// along the ray of the keyframe's camera.
//
// Moving a patch changes only its pose; the pixels are shared. What the weights cannot see is a wrong pose or
// a wrong level of the heights: they blur the fused surface or double it.

#include "patch.hpp"

#include <opencv2/imgproc.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam::fusion::detail {
namespace {

/// At most, for pixels that were filled in from around. It closes the hole where no other touch shows the
/// place, also in the live window: less kMinPixelWeight it is above the viewer's kSmoothBorder.
constexpr float kUnreadWeight = 0.3f;
constexpr double kRimFadeMm = 0.25;    // l of mask_weight()
constexpr double kBeyondMm = 0.15;     // e of mask_weight()
constexpr double kBridgedMm = 0.35;    // half of the length over which the gel returns to rest
constexpr double kBorderFadeMm = 1.5;  // a tenth of a Mini's narrow side

/// From each pixel to the border of the mask, positive inside.
cv::Mat signed_distance_mm(const cv::Mat& mask, double pixel_pitch_mm) {
  cv::Mat inside, outside;
  cv::distanceTransform(mask, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(mask == 0, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return pixel_pitch_mm * (cv::max(inside - 0.5, 0) - cv::max(outside - 0.5, 0));
}

/// sqrt(W), W = (tanh((d + e)/l - 3) + 1)/2, d the distance to the contact's border: near it lies the gel's
/// rim and not the object (Huang et al., T-RO 2026, with e = 0). The root, because our contact ends before
/// most of the rim begins: W itself throws away good views, and the mean gets noisier. The mesh would end
/// 0.2 mm within what has weight, for it takes two voxels beyond its end to end smoothly; e brings its end
/// to the contact's border, but for a voxel. Gel between two crests that are closer than twice kBridgedMm
/// stays within a tenth of their depth and belongs to the surface. Of the pixels in `box`, which holds the
/// contact.
cv::Mat1f mask_weight(const cv::Mat1b& contact, const cv::Rect& box, double pixel_pitch_mm) {
  // All that is closed and a pixel beyond: there, distances are those over the whole picture.
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

/// The image's border cuts a patch off without a rim of the gel: fading it out there keeps it from making a
/// step in the mean.
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
  // One pixel more than has weight keeps the look-up of four neighbors inside.
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
      if (!tilted.allFinite() || !std::isfinite(height_mm)) continue;  // weight 0: it shows nothing
      // A steep slope's height is uncertain by 1/nz: its information falls with nz squared.
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
