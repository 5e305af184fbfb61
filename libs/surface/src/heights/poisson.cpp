// Integrates a map of gradients g to heights h: the minimum of the sum of |grad h - g|², which solves the
// Poisson equation Δh = div g with Neumann (free) boundary conditions, as in photometric stereo and in both
// papers.
//
// To save time, the unknowns are the mean heights of squares of 2x2 pixels. The measured gradient between two
// neighboring pixels is the mean of the gradients of both, and the measured difference between two
// neighboring squares is the sum of such gradients between their centers. A cosine transform along the rows
// diagonalizes the discrete Laplacian in that direction and leaves, for each frequency, one tridiagonal
// system along the columns, which is solved exactly by elimination. The system of frequency 0 is singular,
// because the constant of integration is free; it is integrated separately, in double precision.
//
// The heights of the pixels follow from the mean heights and the gradients of the squares. Two relaxation
// steps on the pixels then remove most of the discontinuities between squares. A gradient field without curl
// is reproduced exactly. Errors of the gradients at one place bend the heights everywhere, and BareGelLeveler
// corrects them afterwards.

#include "heights/poisson.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#ifdef __SSE2__
#include <pmmintrin.h>
#endif

#include "gelslam/core/target_clones.hpp"

namespace gelslam::surface::detail {
namespace {

// While an object of this class exists, denormal numbers are replaced by 0. Values far from the contact
// become that small, and a processor computes a hundred times as slowly with denormal numbers.
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

// OpenCV's cosine transform requires an even length. For an odd number of squares, the last one is
// duplicated.
int even(int length) { return length + length % 2; }

struct GradientRow {
  const float *gx, *gy;
};

// Height differences in a row of squares, in pixels. `rightward` is the part of the step to the right
// neighbor that the pixels of the square itself contribute, so that rightward[u] + leftward[u + 1] is the
// measured difference between the squares u + 1 and u; likewise `downward` and `upward` along columns, and
// `leftward` counts in the direction to the right, `upward` downward. `twist` is a quarter of the difference
// between the sums of the heights at the ends of the two diagonals of a square.
struct SquareRow {
  float *rightward, *leftward, *downward, *upward, *twist;
};
constexpr int kStepsPerSquare = 5;

// Returns row v of the squares' height differences, or null pointers if there is no such row.
SquareRow square_row(cv::Mat1f& steps, int v) {
  const int first = kStepsPerSquare * v;
  if (first < 0 || first >= steps.rows) return {};
  return {steps[first], steps[first + 1], steps[first + 2], steps[first + 3], steps[first + 4]};
}

// Appends a copy of the last square, with no height difference to the original.
void double_last(const SquareRow& row, std::size_t squares) {
  const std::size_t last = squares - 1;
  row.leftward[last] = -row.rightward[last - 1];
  row.downward[last] = row.downward[last - 1];
  row.upward[last] = row.upward[last - 1];
}

// Computes the height differences of a row of squares from two rows of gradients. If the width is odd, the
// last column is used twice.
GELSLAM_CLONES void join_squares(const GradientRow& upper, const GradientRow& lower, std::size_t width,
                                 const SquareRow& to) {
  const auto join = [&](std::size_t u, std::size_t left, std::size_t right) {
    const float x_left = upper.gx[left] + lower.gx[left], x_right = upper.gx[right] + lower.gx[right];
    const float y_upper = upper.gy[left] + upper.gy[right], y_lower = lower.gy[left] + lower.gy[right];
    to.rightward[u] = 0.125F * x_left + 0.375F * x_right;
    to.leftward[u] = 0.375F * x_left + 0.125F * x_right;
    to.downward[u] = 0.125F * y_upper + 0.375F * y_lower;
    to.upward[u] = 0.375F * y_upper + 0.125F * y_lower;
    to.twist[u] = 0.0625F * (x_left + x_right - 2 * (upper.gx[left] + upper.gx[right]) + y_upper + y_lower -
                             2 * (upper.gy[left] + lower.gy[left]));
  };
#pragma GCC ivdep
  for (std::size_t u = 0; u < width / 2; ++u) join(u, 2 * u, 2 * u + 1);
  if (width % 2 != 0) join(width / 2, width - 1, width - 1);
}

// Computes two rows of pixel heights from a row of squares, whose mean heights are `middle`.
GELSLAM_CLONES void split_squares(const float* middle, const SquareRow& from, std::size_t squares,
                                  float scale, float* upper, float* lower) {
#pragma GCC ivdep
  for (std::size_t u = 0; u < squares; ++u) {
    const float height = scale * middle[u], twist = scale * from.twist[u];
    const float to_right = 0.25F * scale * (from.rightward[u] + from.leftward[u]),
                down = 0.25F * scale * (from.downward[u] + from.upward[u]);
    upper[2 * u] = height - to_right - down + twist;
    upper[2 * u + 1] = height + to_right - down - twist;
    lower[2 * u] = height - to_right + down - twist;
    lower[2 * u + 1] = height + to_right + down + twist;
  }
}

// Moves each pixel of a row by `step` times its residual toward the height that its four neighbors and the
// gradients to them predict (Jacobi relaxation). The pixels at the border of the picture keep their heights.
GELSLAM_CLONES void relax_row(const float* above, const float* row, const float* below,
                              const GradientRow& middle, const float* gy_above, const float* gy_below,
                              std::size_t width, float scale, float step, float* relaxed) {
#pragma GCC ivdep
  for (std::size_t u = 1; u + 1 < width; ++u) {
    const float around = above[u] + below[u] + row[u - 1] + row[u + 1];
    const float edges = middle.gx[u - 1] - middle.gx[u + 1] + gy_above[u] - gy_below[u];
    relaxed[u] = row[u] + step * (0.25F * around + 0.125F * scale * edges - row[u]);
  }
  relaxed[0] = row[0];
  relaxed[width - 1] = row[width - 1];
}

// Computes the right side of the Poisson equation: the divergence of the height differences between squares.
// Differences across the border of the image are 0 (Neumann condition).
GELSLAM_CLONES void square_divergence(const SquareRow& above, const SquareRow& row, const SquareRow& below,
                                      std::size_t squares, float* source) {
  std::fill_n(source, squares, 0.0F);
  for (std::size_t u = 0; u + 1 < squares; ++u) source[u] += row.rightward[u] + row.leftward[u + 1];
  for (std::size_t u = 1; u < squares; ++u) source[u] -= row.rightward[u - 1] + row.leftward[u];
  if (above.downward != nullptr)
    for (std::size_t u = 0; u < squares; ++u) source[u] -= above.downward[u] + row.upward[u];
  if (below.upward != nullptr)
    for (std::size_t u = 0; u < squares; ++u) source[u] += row.downward[u] + below.upward[u];
}

// Solves the system of frequency 0, the mean of each row. Its second differences along the columns are
// integrated twice, in double precision because rounding errors accumulate.
void integrate_constant(cv::Mat1f& spectrum) {
  double flux = 0.0, height = 0.0;
  for (int v = 0; v < spectrum.rows; ++v) {
    const double source = static_cast<double>(spectrum(v, 0));
    spectrum(v, 0) = static_cast<float>(height);
    flux += source;
    height += flux;
  }
}

}  // namespace

PoissonSolver::PoissonSolver(cv::Size size)
    : size_(size),
      grid_((size.width + 1) / 2, (size.height + 1) / 2),
      pivot_(grid_.height, even(grid_.width)),
      steps_(kStepsPerSquare * grid_.height, even(grid_.width)),
      solution_(pivot_.size()),
      relaxed_(2 * grid_.height, 2 * grid_.width) {
  for (int k = 0; k < pivot_.cols; ++k) {
    const double eigenvalue = 2.0 - 2.0 * std::cos(std::numbers::pi * k / pivot_.cols);
    double pivot = 0.0;
    for (int v = 0; v < pivot_.rows; ++v) {
      const bool border = v == 0 || v + 1 == pivot_.rows;
      pivot = 1.0 / (eigenvalue + (border ? 1.0 : 2.0) - pivot);
      pivot_(v, k) =
          k == 0 ? 0.0F : static_cast<float>(pivot);  // frequency 0 is singular: integrate_constant()
    }
  }
}

GELSLAM_CLONES void PoissonSolver::solve_columns() {
  const int rows = solution_.rows, columns = solution_.cols;
  integrate_constant(solution_);
  for (int v = 0; v < rows; ++v) {
    const float* pivot = pivot_[v];
    const float* above = v == 0 ? nullptr : solution_[v - 1];
    float* row = solution_[v];
    for (int k = 1; k < columns; ++k) row[k] = ((above == nullptr ? 0.0F : above[k]) - row[k]) * pivot[k];
  }
  for (int v = rows - 2; v >= 0; --v) {
    const float* pivot = pivot_[v];
    const float* below = solution_[v + 1];
    float* row = solution_[v];
    for (int k = 1; k < columns; ++k) row[k] += pivot[k] * below[k];
  }
}

cv::Mat1f PoissonSolver::solve(const cv::Mat1f& gx, const cv::Mat1f& gy) {
  [[maybe_unused]] const FlushDenormals flush{};
  gx_ = gx;
  gy_ = gy;
  const auto width = static_cast<std::size_t>(size_.width), squares = static_cast<std::size_t>(steps_.cols);
  for (int v = 0; v < grid_.height; ++v) {
    const int upper = 2 * v, lower = std::min(upper + 1, size_.height - 1);
    const SquareRow row = square_row(steps_, v);
    join_squares({gx[upper], gy[upper]}, {gx[lower], gy[lower]}, width, row);
    if (grid_.width < steps_.cols) double_last(row, squares);
  }
  for (int v = 0; v < grid_.height; ++v)
    square_divergence(square_row(steps_, v - 1), square_row(steps_, v), square_row(steps_, v + 1), squares,
                      solution_[v]);
  cv::dct(solution_, solution_, cv::DCT_ROWS);
  solve_columns();
  cv::dct(solution_, solution_, cv::DCT_ROWS | cv::DCT_INVERSE);
  return solution_(cv::Rect(cv::Point(), grid_));
}

LineHeights PoissonSolver::line_heights() const {
  LineHeights lines{cv::Mat1f(grid_, 0.0F), cv::Mat1f(grid_, 0.0F)};
  for (int v = 0; v < grid_.height; ++v) {
    const float *rightward = steps_[kStepsPerSquare * v], *leftward = steps_[kStepsPerSquare * v + 1],
                *upward = steps_[kStepsPerSquare * v + 3];
    float* const row = lines.along_rows[v];
    for (int u = 1; u < grid_.width; ++u) row[u] = row[u - 1] + rightward[u - 1] + leftward[u];
    if (v == 0) continue;
    const float *downward = steps_[kStepsPerSquare * (v - 1) + 2], *above = lines.along_columns[v - 1];
    float* const column = lines.along_columns[v];
    for (int u = 0; u < grid_.width; ++u) column[u] = above[u] + downward[u] + upward[u];
  }
  return lines;
}

cv::Mat1f PoissonSolver::pixels(const cv::Mat1f& squares, float scale) {
  cv::Mat1f height(2 * grid_.height, 2 * grid_.width);
  for (int v = 0; v < grid_.height; ++v)
    split_squares(squares[v], square_row(steps_, v), static_cast<std::size_t>(grid_.width), scale,
                  height[2 * v], height[2 * v + 1]);
  // Gradients with curl cause discontinuities between squares. The sizes of the two relaxation steps are
  // those of a Chebyshev iteration for the errors that vary within squares (eigenvalues 0.5 to 2). A fifth of
  // such errors remains.
  const auto relax = [&](const cv::Mat1f& from, float step, cv::Mat1f& to) {
    for (int v = 1; v + 1 < size_.height; ++v)
      relax_row(from[v - 1], from[v], from[v + 1], {gx_[v], gy_[v]}, gy_[v - 1], gy_[v + 1],
                static_cast<std::size_t>(size_.width), scale, step, to[v]);
  };
  height.row(0).copyTo(relaxed_.row(0));
  height.row(size_.height - 1).copyTo(relaxed_.row(size_.height - 1));
  relax(height, 1.39F, relaxed_);
  relax(relaxed_, 0.56F, height);
  return height(cv::Rect(cv::Point(), size_));
}

}  // namespace gelslam::surface::detail
