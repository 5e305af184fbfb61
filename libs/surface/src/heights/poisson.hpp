#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "lanes.hpp"

namespace gelslam::surface::detail {

/// Cosine transform of the rows of an image and its inverse (Lee, IEEE Trans. ASSP 1984), eight rows at once.
class RowTransform {
 public:
  explicit RowTransform(int length);
  /// X_k = sum_i x_i cos(pi (i + 1/2) k / length). Images are as wide as that.
  void forward(const cv::Mat1f& rows, cv::Mat1f& spectrum);
  void inverse(const cv::Mat1f& spectrum, cv::Mat1f& rows);

 private:
  void forward_lanes(Lanes* x, Lanes* room, std::size_t n, const float* secant) const;
  void inverse_lanes(Lanes* x, Lanes* room, std::size_t n, const float* secant) const;
  template <class Transform>
  void each_group(const cv::Mat1f& from, cv::Mat1f& to, const Transform& transform);

  std::size_t length_, odd_;  // odd_: where halving ends
  cv::Mat1f data_;            // eight rows, transposed, and as much room; OpenCV aligns it
  std::vector<float> secants_, cosines_;
};

/// Least-squares height from gradients on a grid, with Neumann (free) borders: the discrete Poisson equation
/// solved exactly, by the cosine transform along rows and a tridiagonal system per frequency along columns.
/// Edge gradient = mean of its two pixels; source = divergence of the edge gradients. (The same solution as a
/// two-dimensional cosine transform with eigenvalues (2cos(pi k/W)-2)+(2cos(pi l/H)-2), in half its time.) A
/// consistent gradient field comes back exactly, up to a constant.
class PoissonSolver {
 public:
  explicit PoissonSolver(cv::Size size);

  /// gx, gy: HxW, height difference per pixel step. Returns HxW heights in pixels, up to a constant (a view
  /// of the work buffer, valid until the next call).
  cv::Mat1f solve(const cv::Mat1f& gx, const cv::Mat1f& gy);

  /// The divergence of the last solve's edge gradients, HxW: inside the image the central difference
  /// d(gx)/dx + d(gy)/dy, hence the Laplacian of height in 1/pixel.
  cv::Mat1f divergence() const;

 private:
  void solve_columns();

  cv::Size size_;
  RowTransform transform_;
  cv::Mat1f pivot_;  // inverse pivots of the tridiagonal systems, one column per frequency
  cv::Mat1f source_, spectrum_, height_;
};

/// Unit normals (-gx, -gy, 1) normalized.
cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Curvature as Surface has it, from the divergence of the solver's last gradients.
cv::Mat1f curvature_in_contact(const PoissonSolver& solved, const cv::Mat1b& contact);

}  // namespace gelslam::surface::detail
