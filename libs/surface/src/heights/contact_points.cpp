#include "gelslam/surface/contact_points.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam {

std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface) {
  const double center_u = 0.5 * surface.contact.cols - 0.5, center_v = 0.5 * surface.contact.rows - 0.5;
  std::vector<Eigen::Vector3d> points;
  for (int v = kContactPointStepPx / 2; v < surface.contact.rows; v += kContactPointStepPx)
    for (int u = kContactPointStepPx / 2; u < surface.contact.cols; u += kContactPointStepPx)
      if (surface.contact(v, u))
        points.emplace_back((u - center_u) * surface.pixel_pitch_mm, (v - center_v) * surface.pixel_pitch_mm,
                            static_cast<double>(surface.height_mm(v, u)));
  return points;
}

Eigen::Vector2d contact_center_mm(const Surface& surface) {
  const cv::Moments m = cv::moments(surface.contact, true);
  if (!(m.m00 > 0)) return Eigen::Vector2d::Zero();
  return {(m.m10 / m.m00 - 0.5 * surface.contact.cols + 0.5) * surface.pixel_pitch_mm,
          (m.m01 / m.m00 - 0.5 * surface.contact.rows + 0.5) * surface.pixel_pitch_mm};
}

bool shows(const Surface& surface, const Eigen::Vector3d& point_mm) {
  constexpr double kHeightToleranceMm = 0.5;
  const cv::Mat1b& contact = surface.contact;
  const double u = point_mm.x() / surface.pixel_pitch_mm + 0.5 * contact.cols - 0.5;
  const double v = point_mm.y() / surface.pixel_pitch_mm + 0.5 * contact.rows - 0.5;
  if (!(u > -0.5 && v > -0.5 && u < contact.cols - 0.5 && v < contact.rows - 0.5)) return false;
  const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
  return contact(row, column) &&
         std::abs(point_mm.z() - static_cast<double>(surface.height_mm(row, column))) < kHeightToleranceMm;
}

}  // namespace gelslam
