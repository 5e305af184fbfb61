#include "ui/tactile_view.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace gelslam::viewer::detail {
namespace {

cv::Size scaled_size(const cv::Size& from, int width_px) {
  const int width = std::max(1, width_px);
  return {width, std::max(1, cvRound(static_cast<double>(from.height) * width / from.width))};
}

/// Enlarged mask, smooth again: its border is to be drawn without steps.
cv::Mat1b enlarged(const cv::Mat1b& mask, const cv::Size& size) {
  cv::Mat1b large;
  cv::resize(mask, large, size, 0, 0, cv::INTER_CUBIC);
  cv::GaussianBlur(large, large, {5, 5}, 0);
  cv::threshold(large, large, 127, 255, cv::THRESH_BINARY);
  return large;
}

}  // namespace

cv::Mat3b tactile_picture(const LiveTouch& touch, int width_px, const cv::Vec3b& outline_bgr) {
  if (touch.image.empty()) return {};
  const cv::Size size = scaled_size(touch.image.size(), width_px);
  cv::Mat3b picture;
  cv::resize(touch.image, picture, size, 0, 0,
             size.width < touch.image.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  if (!touch.surface || touch.surface->contact.empty()) return picture;
  std::vector<std::vector<cv::Point>> borders;
  cv::findContours(enlarged(touch.surface->contact, size), borders, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  const int thickness = std::max(1, size.width / 120);
  cv::polylines(picture, borders, true, cv::Scalar(20, 20, 20), thickness + 2, cv::LINE_AA);
  cv::polylines(picture, borders, true, cv::Scalar(outline_bgr), thickness, cv::LINE_AA);
  return picture;
}

cv::Mat3b normal_picture(const Surface& surface, int width_px) {
  if (surface.normals.empty()) return {};
  const bool has_contact = surface.contact.size() == surface.normals.size();
  cv::Mat3b colors(surface.normals.size());
  for (int v = 0; v < colors.rows; ++v)
    for (int u = 0; u < colors.cols; ++u) {
      const cv::Vec3f n = surface.normals(v, u);
      const bool touched = !has_contact || surface.contact(v, u) != 0;
      cv::Vec3b& color = colors(v, u);
      for (int channel = 0; channel < 3; ++channel) {
        const float full = 127.5F * (1.0F + n[2 - channel]);  // BGR holds z, y, x
        color[channel] = cv::saturate_cast<uchar>(touched ? full : 0.25F * full + 45.0F);
      }
    }
  cv::Mat3b picture;
  const cv::Size size = scaled_size(colors.size(), width_px);
  cv::resize(colors, picture, size, 0, 0, size.width < colors.cols ? cv::INTER_AREA : cv::INTER_LINEAR);
  return picture;
}

}  // namespace gelslam::viewer::detail
