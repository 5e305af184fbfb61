#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "judging/gel_change.hpp"
#include "presses/press_fit.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr float kDarkLevels = 10.0F;  // keeps the relative change finite where there is no light
constexpr double kWindowRadii = 2.0, kWindowMarginPx = 10.0;

}  // namespace

cv::Mat3f relative_change(const cv::Mat3b& bgr, const cv::Mat3b& background) {
  cv::Mat3f relative, soft_background;
  cv::subtract(bgr, background, relative, cv::noArray(), CV_32F);
  relative -= median_color(relative);  // what all of the picture has in common: another exposure
  background.convertTo(soft_background, CV_32F);
  cv::GaussianBlur(soft_background, soft_background, cv::Size(), 1.0);
  cv::GaussianBlur(relative, relative, cv::Size(), 1.0);
  std::transform(relative.begin(), relative.end(), soft_background.begin(), relative.begin(),
                 [](const cv::Vec3f& c, const cv::Vec3f& b) {
                   return cv::Vec3f(c[0] / (b[0] + kDarkLevels), c[1] / (b[1] + kDarkLevels),
                                    c[2] / (b[2] + kDarkLevels));
                 });
  return relative;
}

PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, const CameraModel& camera,
                          double wanted) {
  const double reach = kWindowRadii * contact.radius_px + kWindowMarginPx;
  const cv::Point first(static_cast<int>(contact.u_px - reach), static_cast<int>(contact.v_px - reach)),
      last(static_cast<int>(contact.u_px + reach) + 2, static_cast<int>(contact.v_px + reach) + 2);
  const cv::Rect window = cv::Rect(first, last) & cv::Rect(0, 0, relative.cols, relative.rows);
  const int stride = std::max(1, static_cast<int>(std::lround(std::sqrt(window.area() / wanted))));
  PressPoints points;
  for (int v = window.y; v < window.y + window.height; v += stride)
    for (int u = window.x; u < window.x + window.width; u += stride) {
      const Eigen::Vector2d raw_px(u, v), px = camera.optics.has_lens() ? camera.rest_px(raw_px) : raw_px;
      points.u_px.push_back(px.x());
      points.v_px.push_back(px.y());
      if (camera.optics.inverse_distance() > 0) {
        const Eigen::Vector2d rise = camera.to_mm(px) * camera.optics.inverse_distance();
        points.rise_x.push_back(rise.x());
        points.rise_y.push_back(rise.y());
      }
      for (int channel = 0; channel < 3; ++channel)
        points.change[static_cast<std::size_t>(channel)].push_back(
            static_cast<double>(relative(v, u)[channel]));
    }
  return points;
}

}  // namespace gelslam::calibration::detail
