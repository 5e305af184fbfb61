#include "slopes/gradient_map.hpp"

namespace gelslam::surface::detail {

constexpr int tile = gradient_tile_pixels;

GradientMap::GradientMap(const GradientModel& model, const cv::Mat3b& background)
    : weights_(pack_weights(model)),
      background_gx_(background.size(), 0.0F),
      background_gy_(background.size(), 0.0F),
      features_(static_cast<std::size_t>(gradient_features) * tile, 0.0F),
      pixels_(tile, 0) {
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
      float* feature = features_.data() + count;
      feature[0] = colors[0][color[u][0]] * to_unit;
      feature[tile] = colors[1][color[u][1]] * to_unit;
      feature[2 * tile] = colors[2][color[u][2]] * to_unit;
      feature[3 * tile] = column_[static_cast<std::size_t>(u)];
      feature[4 * tile] = row_[static_cast<std::size_t>(v)];
      pixels_[static_cast<std::size_t>(count)] = v * bgr.cols + u;
      if (++count == tile) {
        run_tile(count, gx, gy);
        count = 0;
      }
    }
  }
  if (count > 0) run_tile(count, gx, gy);
}

void GradientMap::run_tile(int count, cv::Mat1f& gx, cv::Mat1f& gy) {
  alignas(64) float tile_gx[tile];
  alignas(64) float tile_gy[tile];
  gradient_tile(weights_, features_.data(), tile_gx, tile_gy);
  float* out_x = gx.ptr<float>();
  float* out_y = gy.ptr<float>();
  const float* background_x = background_gx_.ptr<float>();
  const float* background_y = background_gy_.ptr<float>();
  for (int i = 0; i < count; ++i) {
    const int pixel = pixels_[static_cast<std::size_t>(i)];
    out_x[pixel] = tile_gx[i] - background_x[pixel];
    out_y[pixel] = tile_gy[i] - background_y[pixel];
  }
}

}  // namespace gelslam::surface::detail
