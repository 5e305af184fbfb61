#include "heights/gel_pressure.hpp"

#include <opencv2/imgproc.hpp>

#include "photometry/block_image.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double kBlurSigmaBlocks = 1.2;
constexpr double kPressedShare = 0.5;  // of the depth; a membrane rim has 0, a flat face 1

}  // namespace

void PressureMap::find(const cv::Mat1f& height_mm, double pixel_pitch_mm, cv::Mat1b& pressed) {
  cv::resize(height_mm, depth_, block_grid(height_mm.size()), 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(-depth_, depth_, cv::Size(5, 5), kBlurSigmaBlocks, 0, cv::BORDER_REPLICATE);
  cv::Laplacian(depth_, laplacian_, CV_32F, 1, 1, 0, cv::BORDER_REPLICATE);
  const double rim_length_blocks = rim_length_mm_ / (pixel_pitch_mm * block_px);
  cv::addWeighted(depth_, 1.0 - kPressedShare, laplacian_, -rim_length_blocks * rim_length_blocks, 0.0,
                  excess_);
  cv::resize(excess_, excess_px_, height_mm.size(), 0, 0, cv::INTER_LINEAR);
  cv::compare(excess_px_, 0.0, pressed, cv::CMP_GT);
}

}  // namespace gelslam::surface::detail
