#include "heights/poisson.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#ifdef __SSE2__
#include <pmmintrin.h>
#endif

#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::surface::detail {
namespace {

// Far from the contact values fall below the smallest normal number, with which a processor computes a
// hundred times as slowly. While this lives, such values are 0.
class FlushDenormals {
 public:
#ifdef __SSE2__
  FlushDenormals() : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
  }
  ~FlushDenormals() { _mm_setcsr(before_); }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  unsigned before_;
#endif
};

// The transform halves its length at least once; an odd width is solved on a grid with its last column
// doubled.
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

RowTransform::RowTransform(int length)
    : length_(static_cast<std::size_t>(length)), data_(2 * length, kLanes) {
  for (std::size_t n = length_; n % 2 == 0; n /= 2)
    for (std::size_t i = 0; i < n / 2; ++i)
      secants_.push_back(static_cast<float>(
          0.5 / std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n))));
  odd_ = length_;
  while (odd_ % 2 == 0) odd_ /= 2;
  for (std::size_t k = 0; k < odd_; ++k)
    for (std::size_t i = 0; i < odd_; ++i)
      cosines_.push_back(static_cast<float>(std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) *
                                                     static_cast<double>(k) / static_cast<double>(odd_))));
}

// x = matrix x, or its transpose; Size: known to the compiler where it is 5, as of all usual widths.
template <std::size_t Size, bool ByRows, class Lanes>
[[gnu::always_inline]] inline void multiply(const float* matrix, Lanes* x, Lanes* room,
                                            std::size_t any_size) {
  const std::size_t n = Size > 0 ? Size : any_size;
  Lanes local[Size > 0 ? Size : 1];
  Lanes* const copy = Size > 0 ? local : room;
  for (std::size_t i = 0; i < n; ++i) copy[i] = x[i];
  for (std::size_t k = 0; k < n; ++k) {
    Lanes sum = matrix[ByRows ? k * n : k] * copy[0];
    for (std::size_t i = 1; i < n; ++i) sum += matrix[ByRows ? k * n + i : i * n + k] * copy[i];
    x[k] = sum;
  }
}

// X_k = sum_i x_i cos(pi (i + 1/2) k / n). Sums of mirrored values have the even coefficients; differences,
// divided by 2 cos, have sums of neighboring odd ones.
GELSLAM_CLONES void RowTransform::forward_lanes(Lanes* x, Lanes* room, std::size_t n,
                                                const float* secant) const {
  if (n == odd_) {
    if (n == 5)
      multiply<5, 1>(cosines_.data(), x, room, n);
    else
      multiply<0, 1>(cosines_.data(), x, room, n);
    return;
  }
  const std::size_t half = n / 2;
  for (std::size_t i = 0; i < half; ++i) {
    room[i] = x[i] + x[n - 1 - i];
    room[half + i] = (x[i] - x[n - 1 - i]) * secant[i];
  }
  forward_lanes(room, x, half, secant + half);
  forward_lanes(room + half, x, half, secant + half);
  for (std::size_t k = 0; k + 1 < half; ++k) {
    x[2 * k] = room[k];
    x[2 * k + 1] = room[half + k] + room[half + k + 1];
  }
  x[n - 2] = room[half - 1];
  x[n - 1] = room[n - 1];
}

// The transpose: x_i = sum_k X_k cos(pi (i + 1/2) k / n), step by step backward.
GELSLAM_CLONES void RowTransform::inverse_lanes(Lanes* x, Lanes* room, std::size_t n,
                                                const float* secant) const {
  if (n == odd_) {
    if (n == 5)
      multiply<5, 0>(cosines_.data(), x, room, n);
    else
      multiply<0, 0>(cosines_.data(), x, room, n);
    return;
  }
  const std::size_t half = n / 2;
  Lanes before{};
  for (std::size_t k = 0; k < half; ++k) {
    room[k] = x[2 * k];
    room[half + k] = x[2 * k + 1] + before;
    before = x[2 * k + 1];
  }
  inverse_lanes(room, x, half, secant + half);
  inverse_lanes(room + half, x, half, secant + half);
  for (std::size_t i = 0; i < half; ++i) {
    const Lanes odd = room[half + i] * secant[i];
    x[i] = room[i] + odd;
    x[n - 1 - i] = room[i] - odd;
  }
}

template <class Transform>
void RowTransform::each_group(const cv::Mat1f& from, cv::Mat1f& to, const Transform& transform) {
  auto* const values = reinterpret_cast<Lanes*>(data_.ptr<float>());
  for (int top = 0; top < from.rows; top += kLanes) {
    const int count = std::min(kLanes, from.rows - top);
    for (int lane = 0; lane < kLanes; ++lane) {
      const float* row = from[top + std::min(lane, count - 1)];
      for (std::size_t u = 0; u < length_; ++u) values[u][lane] = row[u];
    }
    transform(values, values + length_);
    for (int lane = 0; lane < count; ++lane) {
      float* row = to[top + lane];
      for (std::size_t u = 0; u < length_; ++u) row[u] = values[u][lane];
    }
  }
}

void RowTransform::forward(const cv::Mat1f& rows, cv::Mat1f& spectrum) {
  each_group(rows, spectrum,
             [&](Lanes* x, Lanes* room) { forward_lanes(x, room, length_, secants_.data()); });
}

void RowTransform::inverse(const cv::Mat1f& spectrum, cv::Mat1f& rows) {
  const float scale = 2.0F / static_cast<float>(length_);
  each_group(spectrum, rows, [&](Lanes* x, Lanes* room) {
    x[0] *= 0.5F;
    for (std::size_t k = 0; k < length_; ++k) x[k] *= scale;
    inverse_lanes(x, room, length_, secants_.data());
  });
}

PoissonSolver::PoissonSolver(cv::Size size)
    : size_(size),
      transform_(even(size.width)),
      pivot_(size.height, even(size.width)),
      source_(pivot_.size()) {
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
  [[maybe_unused]] const FlushDenormals flush{};
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
  spectrum_.create(source_.size());
  height_.create(source_.size());
  transform_.forward(source_, spectrum_);
  solve_columns();
  transform_.inverse(spectrum_, height_);
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
  cv::Mat1f curvature(contact.size(), 0.0F);
  const cv::Rect box = cv::boundingRect(contact);
  if (box.empty()) return curvature;
  cv::Mat1f inside = curvature(box);
  cv::GaussianBlur(solved.divergence()(box), inside, cv::Size(5, 5), 0.0);
  clip_curvature_to_contact(contact(box), inside);
  return curvature;
}

}  // namespace gelslam::surface::detail
