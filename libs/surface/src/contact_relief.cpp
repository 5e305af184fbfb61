#include "gelslam/surface/contact_relief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/packed_surface.hpp"
#include "point_on_surface.hpp"

namespace gelslam {
namespace {

constexpr std::int16_t kNoContact = std::numeric_limits<std::int16_t>::min();

}  // namespace

ContactRelief::ContactRelief(const Surface& surface)
    : camera_(surface.camera()), box_(cv::boundingRect(surface.contact)), height_(box_.size(), kNoContact) {
  for (int v = 0; v < box_.height; ++v)
    for (int u = 0; u < box_.width; ++u) {
      const cv::Point at(box_.x + u, box_.y + v);
      if (surface.contact(at)) height_(v, u) = PackedSurface::height_steps(surface.height_mm(at));
    }
}

bool shows(const ContactRelief& relief, const Eigen::Vector3d& point_mm) {
  const std::optional<cv::Point> pixel = relief.camera_.pixel_at(point_mm);
  if (!pixel || !relief.box_.contains(*pixel)) return false;
  const std::int16_t steps = relief.height_(*pixel - relief.box_.tl());
  return steps != kNoContact &&
         surface::detail::is_close(point_mm, PackedSurface::kHeightStepMm * static_cast<float>(steps));
}

}  // namespace gelslam
