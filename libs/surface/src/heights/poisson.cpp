#include "heights/poisson.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace gelslam::surface::detail {
namespace {

// cv::dct knows even lengths only; an odd width is solved on a grid with its last column doubled.
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

// The constant along rows: second differences in v alone, integrated twice in double because nothing damps
// rounding.
void integrate_constant(cv::Mat1f& spectrum) {
  double flux = 0.0, height = 0.0;
  for (int v = 0; v < spectrum.rows; ++v) {
    const double source = static_cast<double>(spectrum(v, 0));
    spectrum(v, 0) = static_cast<float>(height);
    flux += source;
    height += flux;
  }
}

void clip_curvature_to_contact(const cv::Mat1b& contact, cv::Mat1f& curvature) {
  for (int v = 0; v < curvature.rows; ++v) {
    const unsigned char* inside = contact[v];
    float* value = curvature[v];
    for (int u = 0; u < curvature.cols; ++u) {
      value[u] = inside[u] != 0 ? std::clamp(value[u], -kMaxCurvature, kMaxCurvature) : 0.0F;
    }
  }
}

}  // namespace

PoissonSolver::PoissonSolver(cv::Size size)
    : size_(size), pivot_(size.height, even(size.width)), source_(pivot_.size()) {
  for (int k = 0; k < pivot_.cols; ++k) {
    const double eigenvalue = 2.0 - 2.0 * std::cos(std::numbers::pi * k / pivot_.cols);
    double pivot = 0.0;
    for (int v = 0; v < pivot_.rows; ++v) {
      const bool border = v == 0 || v + 1 == pivot_.rows;
      pivot = 1.0 / (eigenvalue + (border ? 1.0 : 2.0) - pivot);
      pivot_(v, k) =
          k == 0 ? 0.0F : static_cast<float>(pivot);  // frequency 0 is singular and solved by itself
    }
  }
}

void PoissonSolver::solve_columns() {
  const int rows = spectrum_.rows, columns = spectrum_.cols;
  integrate_constant(spectrum_);
  for (int v = 0; v < rows; ++v) {
    const float* pivot = pivot_[v];
    const float* above = v == 0 ? nullptr : spectrum_[v - 1];
    float* row = spectrum_[v];
    for (int k = 1; k < columns; ++k) row[k] = ((above == nullptr ? 0.0F : above[k]) - row[k]) * pivot[k];
  }
  for (int v = rows - 2; v >= 0; --v) {
    const float* pivot = pivot_[v];
    const float* below = spectrum_[v + 1];
    float* row = spectrum_[v];
    for (int k = 1; k < columns; ++k) row[k] += pivot[k] * below[k];
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
  if (source_.cols > size_.width) {
    // The doubled column has no flux to its neighbor, and along itself what its neighbor has.
    float before = 0.0F;
    for (int v = 0; v < size_.height; ++v) {
      const float after =
          v + 1 < size_.height ? 0.5F * (gy(v, size_.width - 1) + gy(v + 1, size_.width - 1)) : 0.0F;
      source_(v, size_.width) = after - before;
      before = after;
    }
  }
  cv::dct(source_, spectrum_, cv::DCT_ROWS);
  solve_columns();
  cv::idct(spectrum_, height_, cv::DCT_ROWS);
  return height_(cv::Rect(cv::Point(), size_));
}

cv::Mat1f PoissonSolver::divergence() const { return source_(cv::Rect(cv::Point(), size_)); }

cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  cv::Mat3f normals(gx.size());
  for (int v = 0; v < gx.rows; ++v) {
    const float* x = gx[v];
    const float* y = gy[v];
    float* out = normals[v]->val;
    for (int u = 0; u < gx.cols; ++u) {
      const float z = 1.0F / std::sqrt(1.0F + x[u] * x[u] + y[u] * y[u]);
      out[3 * u] = -x[u] * z;
      out[3 * u + 1] = -y[u] * z;
      out[3 * u + 2] = z;
    }
  }
  return normals;
}

cv::Mat1f curvature_in_contact(const PoissonSolver& solved, const cv::Mat1b& contact) {
  cv::Mat1f curvature;
  cv::GaussianBlur(solved.divergence(), curvature, cv::Size(5, 5), 0.0);
  clip_curvature_to_contact(contact, curvature);
  return curvature;
}

}  // namespace gelslam::surface::detail
