#include "gelslam/surface/resampling.hpp"

#include <opencv2/imgproc.hpp>

namespace gelslam {

SurfacePtr resampled(const Surface& surface, double pixel_pitch_mm) {
  auto result = std::make_shared<Surface>(surface);
  if (surface.pixel_pitch_mm == pixel_pitch_mm) return result;
  const double ratio = pixel_pitch_mm / surface.pixel_pitch_mm;  // old pixels per new one
  const cv::Size size(cvRound(surface.contact.cols / ratio), cvRound(surface.contact.rows / ratio));
  const double u0 = 0.5 * (surface.contact.cols - 1) - ratio * 0.5 * (size.width - 1),
               v0 = 0.5 * (surface.contact.rows - 1) - ratio * 0.5 * (size.height - 1);
  const cv::Matx23d old_of_new(ratio, 0, u0, 0, ratio, v0);
  const auto warp = [&](const auto& map, auto& to, int interpolation) {
    cv::warpAffine(map, to, old_of_new, size, interpolation | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  };
  cv::Mat height, normals, contact, confidence, curvature;
  warp(surface.height_mm, height, cv::INTER_LINEAR);
  warp(surface.normals, normals, cv::INTER_LINEAR);
  warp(surface.contact, contact, cv::INTER_NEAREST);
  warp(surface.curvature, curvature, cv::INTER_LINEAR);
  if (!surface.confidence.empty()) warp(surface.confidence, confidence, cv::INTER_NEAREST);
  result->height_mm = height;
  result->normals = normals;
  for (cv::Vec3f& normal : result->normals) normal = cv::normalize(normal);
  result->contact = contact;
  result->confidence = confidence;
  result->curvature = cv::Mat1f(curvature * ratio);  // per pixel
  result->curvature.setTo(0, result->contact == 0);
  result->pixel_pitch_mm = pixel_pitch_mm;
  result->contact_pixels = cv::countNonZero(result->contact);
  return result;
}

}  // namespace gelslam
