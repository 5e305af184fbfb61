#include "gelslam/surface/surface.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace gelslam {

std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface) {
  std::vector<Eigen::Vector3d> points;
  for (int v = kContactPointStepPx / 2; v < surface.contact.rows; v += kContactPointStepPx)
    for (int u = kContactPointStepPx / 2; u < surface.contact.cols; u += kContactPointStepPx)
      if (surface.contact(v, u)) points.push_back(surface.point_mm({u, v}));
  return points;
}

Eigen::Vector2d contact_center_mm(const Surface& surface) {
  const cv::Mat1b& contact = surface.contact;
  double pixels = 0, u_sum = 0, v_sum = 0, height_sum_mm = 0;
  for (int v = 0; v < contact.rows; ++v) {
    const unsigned char* row = contact[v];
    int in_row = 0, u_in_row = 0;
    for (int u = 0; u < contact.cols; ++u) {
      in_row += row[u] != 0 ? 1 : 0;
      u_in_row += row[u] != 0 ? u : 0;
      height_sum_mm += row[u] != 0 ? static_cast<double>(surface.height_mm(v, u)) : 0.0;
    }
    pixels += in_row;
    u_sum += u_in_row;
    v_sum += static_cast<double>(v) * in_row;
  }
  if (!(pixels > 0)) return Eigen::Vector2d::Zero();
  const CameraModel camera = surface.camera();
  const Eigen::Vector2d rest_mm = camera.to_mm(Eigen::Vector2d(u_sum / pixels, v_sum / pixels));
  return camera.point_mm(rest_mm, height_sum_mm / pixels).head<2>();
}

bool is_possible_picture(cv::Size size, double pixel_pitch_mm) {
  constexpr int kMaxSidePx = 4096;
  constexpr double kMaxSideMm = 200;
  const int side_px = std::max(size.width, size.height);
  return size.width >= 1 && size.height >= 1 && side_px <= kMaxSidePx && pixel_pitch_mm >= kMinPixelPitchMm &&
         pixel_pitch_mm <= kMaxPixelPitchMm && side_px * pixel_pitch_mm <= kMaxSideMm;
}

}  // namespace gelslam
