#include "poisson.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

namespace gelslam::surface::detail {
namespace {

// cv::dct knows even sizes only; an odd one is solved on a grid with its last row or column doubled.
int even(int length) { return length + length % 2; }

// source += d(edge gradient) along one row, with no flux through both ends.
void add_row_divergence(const float* gx, float* source, int width) {
  float before = 0.0F;
  for (int u = 0; u + 1 < width; ++u) {
    const float after = 0.5F * (gx[u] + gx[u + 1]);
    source[u] += after - before;
    before = after;
  }
  source[width - 1] -= before;
}

}  // namespace

PoissonSolver::PoissonSolver(cv::Size size) : size_(size) {
  const cv::Size padded(even(size.width), even(size.height));
  inverse_eigenvalue_.create(padded);
  source_.create(padded);
  for (int l = 0; l < padded.height; ++l) {
    for (int k = 0; k < padded.width; ++k) {
      const double eigenvalue = 2.0 * std::cos(std::numbers::pi * k / padded.width) +
                                2.0 * std::cos(std::numbers::pi * l / padded.height) - 4.0;
      inverse_eigenvalue_(l, k) = k == 0 && l == 0 ? 0.0F : static_cast<float>(1.0 / eigenvalue);
    }
  }
}

cv::Mat1f PoissonSolver::solve(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  source_.setTo(0.0F);
  for (int v = 0; v < size_.height; ++v) add_row_divergence(gx[v], source_[v], size_.width);
  for (int v = 0; v + 1 < size_.height; ++v) {
    const float* upper = gy[v];
    const float* lower = gy[v + 1];
    float* source = source_[v];
    float* next = source_[v + 1];
    for (int u = 0; u < size_.width; ++u) {
      const float flux = 0.5F * (upper[u] + lower[u]);
      source[u] += flux;
      next[u] -= flux;
    }
  }
  if (source_.rows > size_.height) {
    // The doubled row has no flux to its neighbour, and along itself what its neighbour has.
    add_row_divergence(gx[size_.height - 1], source_[size_.height], size_.width);
  }
  if (source_.cols > size_.width) {
    float before = 0.0F;
    for (int v = 0; v < size_.height; ++v) {
      const float after =
          v + 1 < size_.height ? 0.5F * (gy(v, size_.width - 1) + gy(v + 1, size_.width - 1)) : 0.0F;
      source_(v, size_.width) = after - before;
      before = after;
    }
  }
  cv::dct(source_, spectrum_);
  cv::multiply(spectrum_, inverse_eigenvalue_, spectrum_);
  cv::idct(spectrum_, height_);
  return height_(cv::Rect(cv::Point(), size_));
}

cv::Mat1f PoissonSolver::divergence() const { return source_(cv::Rect(cv::Point(), size_)); }

}  // namespace gelslam::surface::detail
