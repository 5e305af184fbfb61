#include "photometry/impulse_remover.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

// Neighbors on a gel differ by less than ten, with strong noise by twenty. A dithered picture's differ by 60
// at times, and there means tell more than medians: only pixels further off prove that a picture has wrong
// ones.
constexpr int impulse_gray_levels = 35, sure_gray_levels = 100;
constexpr int looked_at_every = 4;  // rows
constexpr int one_in = 500;         // values: a few are left to robust weights

bool has_impulses(const cv::Mat3b& bgr) {
  int found = 0;
  for (int v = 0; v < bgr.rows; v += looked_at_every) {
    const unsigned char* value = bgr.ptr<unsigned char>(v);
    for (int i = 3; i < 3 * bgr.cols - 3; ++i) {
      const int low = std::min(value[i - 3], value[i + 3]), high = std::max(value[i - 3], value[i + 3]);
      found += (value[i] > high + sure_gray_levels) | (value[i] < low - sure_gray_levels);
    }
  }
  return found * looked_at_every * one_in > 3 * static_cast<int>(bgr.total());
}

}  // namespace

const cv::Mat3b& ImpulseRemover::clean(const cv::Mat3b& bgr) {
  if (!has_impulses(bgr)) return bgr;
  cv::medianBlur(bgr, median_, 3);
  cv::absdiff(bgr, median_, difference_);
  for (int v = 0; v < bgr.rows; ++v) {
    const unsigned char* seen = bgr.ptr<unsigned char>(v);
    const unsigned char* difference = difference_.ptr<unsigned char>(v);
    unsigned char* value = median_.ptr<unsigned char>(v);
    for (int i = 0; i < 3 * bgr.cols; ++i)
      if (difference[i] <= impulse_gray_levels) value[i] = seen[i];
  }
  return median_;
}

}  // namespace gelslam::surface::detail
