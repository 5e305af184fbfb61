#include "heights/rest_grid.hpp"

#include <opencv2/imgproc.hpp>

#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double kNowhere = -1e4;  // beyond any picture

/// `from(pixel)`: where a pixel of the result comes from. `cell_px`: pixels of the picture along one of the
/// grid.
template <typename From>
cv::Mat2f places(cv::Size grid, int cell_px, const From& from) {
  cv::Mat2f at(grid);
  const double middle = 0.5 * (cell_px - 1);
  for (int v = 0; v < grid.height; ++v)
    for (int u = 0; u < grid.width; ++u) {
      const Eigen::Vector2d px = from(Eigen::Vector2d(cell_px * u + middle, cell_px * v + middle));
      at(v, u) = {static_cast<float>((px.x() - middle) / cell_px),
                  static_cast<float>((px.y() - middle) / cell_px)};
    }
  return at;
}

template <typename Way>
cv::Mat taken(const cv::Mat& map, const Way& way) {
  if (way.at.empty()) return map;
  cv::Mat result;
  cv::remap(map, result, way.at, way.between, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return result;
}

}  // namespace

RestGrid::RestGrid(const CameraModel& camera) {
  if (!camera.optics.has_lens()) return;
  const auto raw_of = [&](const Eigen::Vector2d& px) {
    return camera.raw_px(px).value_or(Eigen::Vector2d(kNowhere, kNowhere));
  };
  const auto prepare = [](const cv::Mat2f& at, Way& way) {
    cv::convertMaps(at, cv::noArray(), way.at, way.between, CV_16SC2);
  };
  const cv::Mat2f pixels = places(camera.size, 1, raw_of);
  prepare(pixels, to_rest_);
  prepare(places(block_grid(camera.size), kBlockPx, raw_of), blocks_to_rest_);
  prepare(places(block_grid(camera.size), kBlockPx,
                 [&](const Eigen::Vector2d& px) { return camera.rest_px(px); }),
          blocks_to_raw_);
  beyond_.create(camera.size);
  for (int v = 0; v < beyond_.rows; ++v)
    for (int u = 0; u < beyond_.cols; ++u) {
      const cv::Vec2f& at = pixels(v, u);
      beyond_(v, u) = camera.pixel_of({at[0], at[1]}) ? 0 : 255;
    }
}

cv::Mat RestGrid::resample(const cv::Mat& raw) const { return taken(raw, to_rest_); }
cv::Mat RestGrid::resample_blocks(const cv::Mat& raw) const { return taken(raw, blocks_to_rest_); }

cv::Mat1b RestGrid::resample_mask(const cv::Mat1b& raw_blocks) const {
  return blocks_to_rest_.at.empty() ? raw_blocks : cv::Mat1b(resample_blocks(raw_blocks) > 0);
}

cv::Mat1b RestGrid::raw_mask(const cv::Mat1b& rest_blocks) const {
  return blocks_to_raw_.at.empty() ? rest_blocks : cv::Mat1b(taken(rest_blocks, blocks_to_raw_) > 0);
}

void RestGrid::remove_beyond(cv::Mat1b& rest) const {
  if (!beyond_.empty()) rest.setTo(0, beyond_);
}

}  // namespace gelslam::surface::detail
