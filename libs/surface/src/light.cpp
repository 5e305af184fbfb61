#include "light.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gelslam::surface::detail {
namespace {

constexpr double gate_gray_levels =
    2.5;  // noise of a block mean is below 1; a slope of 1 degree changes colour by 2.7
constexpr double min_inlier_share = 0.1;
constexpr double switch_advantage =
    1.3;  // a contact that covers half the gel must not look like a change of light
// Variance of the background's brightness below which gain and offset cannot be told apart and gain stays 1.
constexpr double gain_prior_variance = 4.0;

double squared_residual(const Light& light, const cv::Vec3f& seen, const cv::Vec3f& background) {
  double sum = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    const double residual = seen[channel] - light.gain[c] * background[channel] - light.offset[c];
    sum += residual * residual;
  }
  return sum;
}

}  // namespace

ColorTable color_table(const Light& light) {
  ColorTable table;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t value = 0; value < 256; ++value) {
      table[c][value] = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
  return table;
}

void to_background_light(const Light& light, cv::Mat3f& means) {
  for (cv::Vec3f& mean : means) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = mean[static_cast<int>(c)];
      value = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
}

LightTracker::LightTracker(const cv::Mat3f& background_blocks)
    : background_(background_blocks.clone()),
      inliers_(background_blocks.size(), static_cast<unsigned char>(0)) {}

int LightTracker::select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light,
                                 double gate) {
  int count = 0;
  for (int row = 0; row < blocks.rows; ++row) {
    for (int column = 0; column < blocks.cols; ++column) {
      const bool agrees =
          (excluded.empty() || excluded(row, column) == 0) &&
          squared_residual(light, blocks(row, column), background_(row, column)) < gate * gate;
      inliers_(row, column) = agrees ? 1 : 0;
      count += agrees ? 1 : 0;
    }
  }
  return count;
}

Light LightTracker::fit(const cv::Mat3f& blocks) const {
  double count = 0.0;
  cv::Vec3d sum_background, sum_seen, sum_squares, sum_products;
  for (int row = 0; row < blocks.rows; ++row) {
    for (int column = 0; column < blocks.cols; ++column) {
      if (inliers_(row, column) == 0) continue;
      const cv::Vec3d background = background_(row, column), seen = blocks(row, column);
      count += 1.0;
      sum_background += background;
      sum_seen += seen;
      sum_squares += background.mul(background);
      sum_products += background.mul(seen);
    }
  }
  Light light;
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    const double mean_background = sum_background[channel] / count, mean_seen = sum_seen[channel] / count;
    const double variance = sum_squares[channel] / count - mean_background * mean_background;
    const double covariance = sum_products[channel] / count - mean_background * mean_seen;
    const double gain = (covariance + gain_prior_variance) / (variance + gain_prior_variance);
    light.gain[c] = std::clamp(gain, 0.5, 2.0);
    light.offset[c] = mean_seen - light.gain[c] * mean_background;
  }
  return light;
}

Light LightTracker::shifted_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded) const {
  Light light;
  std::vector<float> differences;
  for (int channel = 0; channel < 3; ++channel) {
    differences.clear();
    for (int row = 0; row < blocks.rows; ++row) {
      for (int column = 0; column < blocks.cols; ++column) {
        if (!excluded.empty() && excluded(row, column) != 0) continue;
        differences.push_back(blocks(row, column)[channel] - background_(row, column)[channel]);
      }
    }
    if (differences.empty()) return light;
    const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
    std::nth_element(differences.begin(), middle, differences.end());
    light.offset[static_cast<std::size_t>(channel)] = *middle;
  }
  return light;
}

const Light& LightTracker::update(const cv::Mat3f& blocks, const cv::Mat1b& excluded) {
  const Light shifted = shifted_by_median(blocks, excluded);
  const int agree_shifted = select_inliers(blocks, excluded, shifted, gate_gray_levels);
  const int agree_last = select_inliers(blocks, excluded, light_, gate_gray_levels);
  const int enough = static_cast<int>(min_inlier_share * static_cast<double>(blocks.total()));
  Light light = agree_shifted > switch_advantage * agree_last ? shifted : light_;
  for (int iteration = 0; iteration < 3; ++iteration) {
    if (select_inliers(blocks, excluded, light, gate_gray_levels) < enough) return light_;
    light = fit(blocks);
  }
  light_ = light;
  return light_;
}

}  // namespace gelslam::surface::detail
