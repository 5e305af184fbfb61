// The gel as a membrane under tension on an elastic foundation, deformed by an obstacle.
//
// The displacement h from the gel at rest minimizes tension/2 |grad h|² + stiffness/2 h² subject to rest + h
// <= underside of the object. Where the gel is free, the minimum satisfies tension * laplace(h) = stiffness *
// h; where it is in contact, h equals the obstacle. The discrete problem is solved by projected successive
// over-relaxation in red-black order, on grids from coarse to fine, only around the part that the object
// pushes down.

#include "gelslam/simulation/gel.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/target_clones.hpp"
#include "shape_makers.hpp"

namespace gelslam {
namespace {

// Pixels that are simulated beyond the view, because the free border of the grid disturbs a contact that it
// cuts.
constexpr int kBeyondViewPx = 16;
// The size of the solved region is a multiple of this, so that it can be halved three times.
constexpr int kBlockPx = 8;
// After this many relaxation lengths the displacement of the membrane's rim has decayed to less than 1e-4.
constexpr double kRimLengths = 9.0;
constexpr float kContactGapMm = 1e-4F;
constexpr double kRelativeAccuracy = 1e-4;

/// One step of projected red-black relaxation of tension * laplace(h) = stiffness * h, h <= obstacle, for one
/// row of one color. The arrays do not overlap. `side` is the row of the other color, shifted so that side[i]
/// and side[i + 1] are the left and right neighbors.
GELSLAM_TARGET_CLONES("avx512f", "avx2", "default")
void relax_row(float* __restrict self, const float* __restrict up, const float* __restrict down,
               const float* __restrict side, const float* __restrict obstacle, int count, float weight,
               float omega) {
  for (int i = 0; i < count; ++i) {
    const float mean = weight * (up[i] + down[i] + side[i] + side[i + 1]);
    const float moved = self[i] + omega * (mean - self[i]);
    self[i] = moved < obstacle[i] ? moved : obstacle[i];
  }
}

/// Height and obstacle of one grid, separated into the two colors of a checkerboard so that rows can be
/// vectorized. Color c contains the pixels with (x + y) % 2 == c. Ghost rows and columns make the border free
/// (zero slope across it).
class Checkerboard {
 public:
  Checkerboard(const cv::Mat1f& height, const cv::Mat1f& obstacle)
      : width_(height.cols), height_(height.rows), stride_(static_cast<std::size_t>(width_ / 2 + 2)) {
    for (int c = 0; c < 2; ++c) {
      values_[c].assign(stride_ * static_cast<std::size_t>(height_ + 2), 0.0F);
      obstacle_[c] = values_[c];
    }
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        at(values_, x, y) = std::min(height(y, x), obstacle(y, x));
        at(obstacle_, x, y) = obstacle(y, x);
      }
  }

  void sweep(float weight, float omega) {
    for (int c = 0; c < 2; ++c) {
      set_ghosts(c);
      for (int y = 0; y < height_; ++y) {
        const int first_x = (y + c) % 2;
        const float* side = row(values_[1 - c], y) - (first_x == 0 ? 1 : 0);
        relax_row(row(values_[c], y), row(values_[1 - c], y - 1), row(values_[1 - c], y + 1), side,
                  row(obstacle_[c], y), width_ / 2, weight, omega);
      }
    }
  }

  cv::Mat1f result() {
    cv::Mat1f height(height_, width_);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) height(y, x) = at(values_, x, y);
    return height;
  }

 private:
  using Colors = std::vector<float>[2];

  float* row(std::vector<float>& color, int y) {
    return color.data() + static_cast<std::size_t>(y + 1) * stride_ + 1;
  }
  float& at(Colors& colors, int x, int y) { return row(colors[(x + y) % 2], y)[x / 2]; }

  /// Gives the border pixels of color c a neighbor outside with the same value.
  void set_ghosts(int c) {
    std::copy_n(row(values_[c], 0), width_ / 2, row(values_[1 - c], -1));
    std::copy_n(row(values_[c], height_ - 1), width_ / 2, row(values_[1 - c], height_));
    for (int y = 0; y < height_; ++y) {
      float* self = row(values_[c], y);
      float* other = row(values_[1 - c], y);
      if ((y + c) % 2 == 0)
        other[-1] = self[0];
      else
        other[width_ / 2] = self[width_ / 2 - 1];
    }
  }

  int width_, height_;
  std::size_t stride_;
  Colors values_, obstacle_;
};

/// Solves the problem on one grid from an initial guess.
cv::Mat1f relax(const cv::Mat1f& guess, const cv::Mat1f& obstacle, double pitch_mm) {
  const double stiffness = pitch_mm * pitch_mm / (kGelRelaxationMm * kGelRelaxationMm);
  const double jacobi = 4.0 / (4.0 + stiffness);  // spectral radius of Jacobi's iteration
  const double omega = 2.0 / (1.0 + std::sqrt(1.0 - jacobi * jacobi));  // Young's optimum
  const int sweeps =
      10 + static_cast<int>(std::log(kRelativeAccuracy) / std::log(std::max(omega - 1.0, 0.05)));
  Checkerboard board(guess, obstacle);
  for (int k = 0; k < sweeps; ++k)
    board.sweep(static_cast<float>(1.0 / (4.0 + stiffness)), static_cast<float>(omega));
  return board.result();
}

/// Solves from coarse to fine grids. The solution of a coarse grid is a guess for the next one in which only
/// fine detail is wrong.
cv::Mat1f solve(const cv::Mat1f& obstacle, double pitch_mm, int levels) {
  if (levels == 0) return relax(obstacle, obstacle, pitch_mm);
  cv::Mat1f coarse_obstacle, guess;
  cv::resize(obstacle, coarse_obstacle, cv::Size(obstacle.cols / 2, obstacle.rows / 2), 0, 0, cv::INTER_AREA);
  cv::resize(solve(coarse_obstacle, 2 * pitch_mm, levels - 1), guess, obstacle.size(), 0, 0,
             cv::INTER_LINEAR);
  return relax(guess, obstacle, pitch_mm);
}

/// Returns the region where the gel can differ from its rest position: a margin around the pixels pushed
/// below 0, in whole blocks.
cv::Rect affected(const cv::Mat1f& obstacle, double pitch_mm) {
  const cv::Rect pushed = cv::boundingRect(cv::Mat1b(obstacle < 0));
  if (pushed.empty()) return {};
  const int margin = static_cast<int>(std::ceil(kRimLengths * kGelRelaxationMm / pitch_mm));
  const int x0 = std::max(0, pushed.x - margin) / kBlockPx * kBlockPx;
  const int y0 = std::max(0, pushed.y - margin) / kBlockPx * kBlockPx;
  const int x1 = std::min(obstacle.cols, (pushed.br().x + margin + kBlockPx - 1) / kBlockPx * kBlockPx);
  const int y1 = std::min(obstacle.rows, (pushed.br().y + margin + kBlockPx - 1) / kBlockPx * kBlockPx);
  return {x0, y0, x1 - x0, y1 - y0};
}

/// Returns the gradient by central differences, one-sided at the border.
cv::Mat2f slope_of(const cv::Mat1f& height, double pitch_mm) {
  cv::Mat2f slope(height.size());
  const auto inverse = static_cast<float>(1.0 / pitch_mm);
  for (int y = 0; y < height.rows; ++y) {
    const int y0 = std::max(0, y - 1), y1 = std::min(height.rows - 1, y + 1);
    for (int x = 0; x < height.cols; ++x) {
      const int x0 = std::max(0, x - 1), x1 = std::min(height.cols - 1, x + 1);
      slope(y, x) = {(height(y, x1) - height(y, x0)) * inverse / static_cast<float>(x1 - x0),
                     (height(y1, x) - height(y0, x)) * inverse / static_cast<float>(y1 - y0)};
    }
  }
  return slope;
}

/// Sets the radius of the circle to the largest distance of a contact pixel from the center, which is right
/// even if the image cuts the circle.
void measure_circle(PressedBall& pressed) {
  const cv::Mat1b& contact = pressed.gel.contact;
  const cv::Point2d center = pressed.center_px;
  double squared = 0;
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u) {
      const double here = (u - center.x) * (u - center.x) + (v - center.y) * (v - center.y);
      if (contact(v, u) == 0 || !(here > squared)) continue;
      squared = here;
      pressed.ring_height_mm = static_cast<double>(pressed.gel.height_mm(v, u));
    }
  pressed.radius_px = std::sqrt(squared);
}

}  // namespace

GelShape gel_at_rest(const SensorGeometry& geometry) {
  const cv::Size size(geometry.width_px, geometry.height_px);
  GelShape gel{cv::Mat1f(size), cv::Mat1b(size, std::uint8_t{0}), cv::Mat2f(size)};
  const auto [a, b] = geometry.optics.gel_dome_per_mm;
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const auto x = static_cast<double>(geometry.x_mm(u)), y = static_cast<double>(geometry.y_mm(v));
      gel.height_mm(v, u) = static_cast<float>(geometry.rest_mm(x, y));
      gel.slope(v, u) = {static_cast<float>(-2 * a * x), static_cast<float>(-2 * b * y)};
    }
  return gel;
}

GelShape press_gel(const cv::Mat1f& underside_mm, const SensorGeometry& geometry) {
  const cv::Size size = underside_mm.size();
  if (size != cv::Size(geometry.width_px, geometry.height_px) || size.width < 2 * kBlockPx ||
      size.height < 2 * kBlockPx || size.width % kBlockPx != 0 || size.height % kBlockPx != 0)
    throw Error("gel size must be the sensor's and a multiple of 8 pixels");
  const double pitch = geometry.pixel_pitch_mm;
  const GelShape rest = gel_at_rest(geometry);
  GelShape gel;
  // Nothing pulls the gel up, so an object above the gel at rest has the same effect as one that just touches
  // it.
  gel.height_mm = cv::min(underside_mm - rest.height_mm, 0.0F);
  gel.contact = cv::Mat1b::zeros(underside_mm.size());
  const cv::Rect region = affected(gel.height_mm, pitch);
  if (!region.empty()) {
    const cv::Mat1f obstacle = gel.height_mm(region).clone();
    int levels = 0;
    while (levels < 3 && pitch * (2 << levels) <= 2 * kGelRelaxationMm) ++levels;
    const cv::Mat1f height = solve(obstacle, pitch, levels);
    height.copyTo(gel.height_mm(region));
    gel.contact(region).setTo(255, (obstacle < 0) & (obstacle - height <= kContactGapMm));
  }
  gel.slope = slope_of(gel.height_mm, pitch) + rest.slope;
  gel.height_mm += rest.height_mm;
  return gel;
}

GelShape press_object(const Shape& shape, const Pose& sensor_T_object, const SensorGeometry& geometry) {
  SensorGeometry wide = geometry;
  wide.width_px += 2 * kBeyondViewPx;
  wide.height_px += 2 * kBeyondViewPx;
  const GelShape gel = press_gel(object_underside(shape, sensor_T_object, wide), wide);
  const cv::Rect view(kBeyondViewPx, kBeyondViewPx, geometry.width_px, geometry.height_px);
  return {gel.height_mm(view).clone(), gel.contact(view).clone(), gel.slope(view).clone()};
}

PressedBall press_ball(const SensorGeometry& geometry, double ball_radius_mm, double x_mm, double y_mm,
                       double depth_mm) {
  Pose sensor_T_ball = Pose::Identity();
  sensor_T_ball.translation() << x_mm, y_mm, ball_radius_mm - depth_mm;
  PressedBall pressed;
  pressed.gel = press_object(*simulation::detail::make_ball(static_cast<float>(ball_radius_mm)),
                             sensor_T_ball, geometry);
  pressed.center_px = {x_mm / geometry.pixel_pitch_mm + 0.5 * geometry.width_px - 0.5,
                       y_mm / geometry.pixel_pitch_mm + 0.5 * geometry.height_px - 0.5};
  measure_circle(pressed);
  return pressed;
}

}  // namespace gelslam
