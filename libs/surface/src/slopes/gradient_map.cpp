#include "slopes/gradient_map.hpp"

#include <algorithm>

#include "gelslam/core/error.hpp"
#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/gradient_surface.hpp"

namespace gelslam::surface::detail {

namespace {

constexpr float kMaxAngleRad = 1.5F;  // keeps tan finite; no gel is steeper

}  // namespace

// By the power series of sine and cosine, without branches or calls.
GELSLAM_TARGET_CLONES("avx512f", "fma", "default")
void tangents(NetworkTile::Values<2>& angles_rad) {
  for (float& value : angles_rad) {
    const float x = std::min(std::max(value, -kMaxAngleRad), kMaxAngleRad);
    const float s = x * x;
    const float sine =
        x *
        (1.0F + s * (-1.0F / 6 + s * (1.0F / 120 + s * (-1.0F / 5040 + s * (1.0F / 362880 - s / 39916800)))));
    const float cosine =
        1.0F +
        s * (-0.5F + s * (1.0F / 24 +
                          s * (-1.0F / 720 + s * (1.0F / 40320 + s * (-1.0F / 3628800 + s / 479001600)))));
    value = sine / cosine;
  }
}

GradientMap::GradientMap(const GradientModel& model, const cv::Mat3b& background)
    : model_(model), background_gx_(background.size(), 0.0F), background_gy_(background.size(), 0.0F) {
  for (int u = 0; u < background.cols; ++u) {
    column_.push_back(static_cast<float>(u) / static_cast<float>(background.cols));
  }
  for (int v = 0; v < background.rows; ++v)
    row_.push_back(static_cast<float>(v) / static_cast<float>(background.rows));
  cv::Mat1f gx, gy;
  compute(background, color_table(Light{}), cv::Mat1b(background.size(), static_cast<unsigned char>(255)), gx,
          gy);
  background_gx_ = gx;
  background_gy_ = gy;
}

void GradientMap::compute(const cv::Mat3b& bgr, const ColorTable& colors, const cv::Mat1b& where,
                          cv::Mat1f& gx, cv::Mat1f& gy) {
  gx.create(bgr.size());
  gy.create(bgr.size());
  gx.setTo(0.0F);
  gy.setTo(0.0F);
  constexpr float to_unit = 1.0F / 255.0F;
  int count = 0;
  for (int v = 0; v < bgr.rows; ++v) {
    const unsigned char* wanted = where[v];
    const cv::Vec3b* color = bgr[v];
    for (int u = 0; u < bgr.cols; ++u) {
      if (wanted[u] == 0) continue;
      float* feature = tile_.input.data() + count;
      feature[0] = colors[0][color[u][0]] * to_unit;
      feature[kNetworkTile] = colors[1][color[u][1]] * to_unit;
      feature[2 * kNetworkTile] = colors[2][color[u][2]] * to_unit;
      feature[3 * kNetworkTile] = column_[static_cast<std::size_t>(u)];
      feature[4 * kNetworkTile] = row_[static_cast<std::size_t>(v)];
      pixels_[static_cast<std::size_t>(count)] = v * bgr.cols + u;
      if (++count == kNetworkTile) {
        run_tile(count, gx, gy);
        count = 0;
      }
    }
  }
  if (count > 0) run_tile(count, gx, gy);
}

void GradientMap::run_tile(int count, cv::Mat1f& gx, cv::Mat1f& gy) {
  network_forward(model_, tile_);
  tangents(tile_.output);
  const float* const slope_x = tile_.output.data();
  const float* const slope_y = slope_x + kNetworkTile;
  float* out_x = gx.ptr<float>();
  float* out_y = gy.ptr<float>();
  const float* background_x = background_gx_.ptr<float>();
  const float* background_y = background_gy_.ptr<float>();
  for (int i = 0; i < count; ++i) {
    const int pixel = pixels_[static_cast<std::size_t>(i)];
    out_x[pixel] = slope_x[i] - background_x[pixel];
    out_y[pixel] = slope_y[i] - background_y[pixel];
  }
}

}  // namespace gelslam::surface::detail

namespace gelslam {

SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background) {
  if (bgr.size() != background.size()) throw Error("image and background differ in size");
  SlopeMap map;
  using namespace surface::detail;
  GradientMap(model, background)
      .compute(bgr, color_table(Light{}), cv::Mat1b(bgr.size(), static_cast<unsigned char>(255)), map.gx,
               map.gy);
  return map;
}

}  // namespace gelslam
