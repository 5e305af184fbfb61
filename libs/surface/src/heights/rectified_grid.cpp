#include "heights/rectified_grid.hpp"

#include <algorithm>
#include <opencv2/core.hpp>

#include "gelslam/core/target_clones.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double kNowhere = -1e4;  // a pixel coordinate outside any picture

/// Returns for each element of a grid where it lies in the source, both counted in elements. An element is a
/// pixel (`cell_px` = 1) or a block of `cell_px` pixels. `from` maps pixel coordinates of the result to those
/// of the source.
template <typename From>
cv::Mat2f positions(cv::Size grid, int cell_px, const From& from) {
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

RectifiedGrid::Places places_of(const cv::Mat2f& at) {
  const int last_column = at.cols - 2, last_row = at.rows - 2;
  RectifiedGrid::Places places;
  for (const cv::Vec2f& px : at) {
    const float x = std::clamp(px[0], 0.0F, static_cast<float>(at.cols - 1)),
                y = std::clamp(px[1], 0.0F, static_cast<float>(at.rows - 1));
    const int column = std::min(static_cast<int>(x), last_column),
              row = std::min(static_cast<int>(y), last_row);
    places.first.push_back(row * at.cols + column);
    places.right.push_back(x - static_cast<float>(column));
    places.below.push_back(y - static_cast<float>(row));
  }
  return places;
}

GELSLAM_CLONES void interpolate(const float* raw, int columns, const std::int32_t* first, const float* right,
                                const float* below, std::size_t count, float* rest) {
  for (std::size_t i = 0; i < count; ++i) {
    const float *const upper = raw + first[i], *const lower = upper + columns;
    const float above = upper[0] + right[i] * (upper[1] - upper[0]),
                beneath = lower[0] + right[i] * (lower[1] - lower[0]);
    rest[i] = above + below[i] * (beneath - above);
  }
}

cv::Mat1f taken(const cv::Mat1f& map, const RectifiedGrid::Places& places) {
  if (places.first.empty()) return map;
  const cv::Mat1f raw = map.isContinuous() ? map : map.clone();
  cv::Mat1f result(map.size());
  interpolate(raw[0], map.cols, places.first.data(), places.right.data(), places.below.data(), result.total(),
              result[0]);
  return result;
}

cv::Mat1b taken(const cv::Mat1b& map, const RectifiedGrid::Places& places) {
  if (places.first.empty()) return map;
  cv::Mat1f values;
  map.convertTo(values, CV_32F);
  cv::Mat1b result;
  taken(values, places).convertTo(result, CV_8U);
  return result;
}

cv::Mat1b mask_of(const cv::Mat1b& blocks, const RectifiedGrid::Places& places) {
  return places.first.empty() ? blocks : cv::Mat1b(taken(blocks, places) > 127);
}

}  // namespace

RectifiedGrid::RectifiedGrid(const CameraModel& camera) {
  if (!camera.optics.has_lens()) return;
  const auto raw_of = [&](const Eigen::Vector2d& px) {
    return camera.raw_px(px).value_or(Eigen::Vector2d(kNowhere, kNowhere));
  };
  const cv::Size blocks = block_grid(camera.size);
  const cv::Mat2f pixels = positions(camera.size, 1, raw_of);
  to_rectified_ = places_of(pixels);
  blocks_to_rectified_ = places_of(positions(blocks, kBlockPx, raw_of));
  blocks_to_raw_ = places_of(
      positions(blocks, kBlockPx, [&](const Eigen::Vector2d& px) { return camera.rectified_px(px); }));
  beyond_.create(camera.size);
  for (int v = 0; v < beyond_.rows; ++v)
    for (int u = 0; u < beyond_.cols; ++u) {
      const cv::Vec2f& at = pixels(v, u);
      beyond_(v, u) = camera.pixel_of({at[0], at[1]}) ? 0 : 255;
    }
}

cv::Mat1f RectifiedGrid::resample(const cv::Mat1f& raw) const { return taken(raw, to_rectified_); }

cv::Mat1b RectifiedGrid::resample(const cv::Mat1b& raw) const { return taken(raw, to_rectified_); }

cv::Mat1b RectifiedGrid::resample_mask(const cv::Mat1b& raw_blocks) const {
  return mask_of(raw_blocks, blocks_to_rectified_);
}

cv::Mat1b RectifiedGrid::raw_mask(const cv::Mat1b& rectified_blocks) const {
  return mask_of(rectified_blocks, blocks_to_raw_);
}

void RectifiedGrid::remove_beyond(cv::Mat1b& rectified) const {
  if (!beyond_.empty()) rectified.setTo(0, beyond_);
}

}  // namespace gelslam::surface::detail
