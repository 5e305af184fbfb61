#include "gelslam/surface/contact_overlap.hpp"

#include <limits>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/packed_surface.hpp"

namespace gelslam {
namespace {

constexpr std::int16_t kNoContact = std::numeric_limits<std::int16_t>::min();

/// Returns whether a point is close enough to the height of the surface at its pixel. If it is not, it lies
/// on the other side of the object, for example.
bool is_close(const Eigen::Vector3d& point_mm, float height_mm) {
  constexpr double kToleranceMm = 0.5;
  return std::abs(point_mm.z() - static_cast<double>(height_mm)) < kToleranceMm;
}

}  // namespace

bool shows(const Surface& surface, const Eigen::Vector3d& point_mm) {
  const std::optional<cv::Point> pixel = surface.camera().pixel_at(point_mm);
  return pixel && surface.contact(*pixel) && is_close(point_mm, surface.height_mm(*pixel));
}

ContactExtent extent_of(const std::vector<Eigen::Vector3d>& points_mm) {
  ContactExtent extent;
  for (const Eigen::Vector3d& p : points_mm) extent.center_mm += p / static_cast<double>(points_mm.size());
  for (const Eigen::Vector3d& p : points_mm)
    extent.radius_mm = std::max(extent.radius_mm, (p - extent.center_mm).norm());
  return extent;
}

bool may_overlap(const ContactExtent& a, const ContactExtent& b, const Pose& a_T_b) {
  constexpr double kMinFacing = 0.3;  // the cosine between the z axes of two sensors
  return a_T_b.linear()(2, 2) >= kMinFacing &&
         (a_T_b * b.center_mm - a.center_mm).norm() < a.radius_mm + b.radius_mm;
}

ContactRelief::ContactRelief(const Surface& surface, int cell_px) : camera_(surface.camera()) {
  const cv::Size size = camera_.size;
  camera_.size = {(size.width + cell_px - 1) / cell_px, (size.height + cell_px - 1) / cell_px};
  camera_.pitch_mm *= cell_px;
  const cv::Rect box = cv::boundingRect(surface.contact);
  const cv::Point begin = box.tl() / cell_px,
                  end = (box.br() + cv::Point(cell_px - 1, cell_px - 1)) / cell_px;
  box_ = {begin, end};
  height_ = cv::Mat_<std::int16_t>(box_.size(), kNoContact);
  for (int v = 0; v < box_.height; ++v)
    for (int u = 0; u < box_.width; ++u) {
      const cv::Point at(std::min(cell_px * (box_.x + u) + cell_px / 2, size.width - 1),
                         std::min(cell_px * (box_.y + v) + cell_px / 2, size.height - 1));
      if (surface.contact(at)) height_(v, u) = PackedSurface::height_steps(surface.height_mm(at));
    }
}

bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm) {
  const std::optional<cv::Point> pixel = relief.camera_.pixel_at(point_mm);
  if (!pixel || !relief.box_.contains(*pixel)) return false;
  const std::int16_t steps = relief.height_(*pixel - relief.box_.tl());
  return steps != kNoContact && is_close(point_mm, PackedSurface::kHeightStepMm * static_cast<float>(steps));
}

}  // namespace gelslam
