// Judges whether a picture of the bare gel can serve as a background, and says in sentences what is wrong
// with it. These checks are not in the papers. Their limits are far from the values of the backgrounds of
// four real sensors, which the comments below state.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background.hpp"
#include "photometry/pixel_repair.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {
namespace {

using surface::detail::GradientMap;

// A picture whose mean gray level is lower is dark. Real backgrounds have 93 to 122.
constexpr double kDarkLevel = 45.0;
// A picture has no color if its largest channel exceeds its smallest by less than this, averaged over the
// pixels. Real backgrounds have 40 to 70 gray levels.
constexpr double kMinColor = 10.0;
// A pixel is stained if its color differs from the mean of its surroundings by more than kStainLevels (norm
// of the difference in gray levels). The program warns if more than kSpoiltShare of the picture is stained,
// or saturated. On a clean gel, even with a speck, it is less than 0.1 %; with eight stains of 5 to 10
// pixels, it is at least 1.3 %.
constexpr double kStainLevels = 10.0;
constexpr double kSpoiltShare = 0.004;
// The distance between printed dots on the gels of GelSight, and the relative error of the pixel pitch beyond
// which the program warns. Lenses and gels differ by 3 %.
constexpr double kDotSpacingMm = 2.0, kPitchTolerance = 0.1;
// The limit of the change of ln(red / blue) from the middle of a picture to its lower border (and to its
// right border). The backgrounds of GelSight Minis have 0.46 to 0.60 downward, and -0.12 to 0.04 sideways.
constexpr double kRedBlueSlope = 0.25;

bool is_gelsight_mini(const std::string& name) {
  return lower_case(name).find("gelsight mini") != std::string::npos;
}

double share_above(const cv::Mat1f& values, double limit) {
  return static_cast<double>(cv::countNonZero(values > limit)) / static_cast<double>(values.total());
}

struct ChannelRange {
  cv::Mat1f least, most;  ///< the smallest and the largest channel of each pixel
};

ChannelRange channel_range(const cv::Mat3f& bgr) {
  ChannelRange range{cv::Mat1f(bgr.size()), cv::Mat1f(bgr.size())};
  std::transform(bgr.begin(), bgr.end(), range.least.begin(), [](const cv::Vec3f& c) {
    return std::min({c[0], c[1], c[2]});
  });
  std::transform(bgr.begin(), bgr.end(), range.most.begin(), [](const cv::Vec3f& c) {
    return std::max({c[0], c[1], c[2]});
  });
  return range;
}

struct RedOverBlue {
  double downward = 0, sideways = 0;  ///< change of ln(red / blue) from the middle to the border
};

/// Fits a plane to ln(red / blue) by least squares. On a regular grid its two slopes are independent.
RedOverBlue red_over_blue(const cv::Mat3f& bgr) {
  cv::Mat3f small;
  cv::resize(bgr, small, cv::Size(40, 30), 0, 0, cv::INTER_AREA);
  double down = 0, down_2 = 0, side = 0, side_2 = 0;
  for (int v = 0; v < small.rows; ++v) {
    for (int u = 0; u < small.cols; ++u) {
      const double x = (u + 0.5) / small.cols * 2 - 1, y = (v + 0.5) / small.rows * 2 - 1;
      const double value = std::log((small(v, u)[2] + 1.0) / (small(v, u)[0] + 1.0));
      down += value * y;
      down_2 += y * y;
      side += value * x;
      side_2 += x * x;
    }
  }
  return {down / down_2, side / side_2};
}

/// Returns a message if the colors change along the vertical as on a GelSight Mini, but in the wrong
/// direction; else "". `blue_leads`: the mean of blue exceeds that of red.
std::string judge_mini_orientation(const RedOverBlue& slope, bool blue_leads) {
  if (slope.downward > -kRedBlueSlope || std::abs(slope.sideways) > kRedBlueSlope) return "";
  if (!blue_leads) return "red and blue seem to be swapped: the top is reddish and the bottom bluish";
  return "the picture seems to be upside down: a GelSight Mini's top is bluish, its bottom reddish";
}

bool blue_leads(const cv::Mat3f& bgr) {
  const cv::Scalar mean = cv::mean(bgr);
  return mean[0] > mean[2];  // on real GelSight Minis blue is 1.33 to 1.7 times as bright as red
}

std::string judge_mini_lamps(const cv::Mat3f& bgr) {
  const RedOverBlue slope = red_over_blue(bgr);
  if (std::abs(slope.downward) < kRedBlueSlope || std::abs(slope.sideways) > kRedBlueSlope)
    return "the colors do not lie as a GelSight Mini's (bluish top, reddish bottom): is it the right camera, "
           "and uncropped?";
  if (slope.downward < 0) return judge_mini_orientation(slope, blue_leads(bgr));
  if (!blue_leads(bgr))
    return "red outweighs blue, as on no bare GelSight Mini: check the white balance, and whether red and "
           "blue "
           "are swapped";
  return "";
}

double median_slope(const cv::Mat3b& mean, const GradientModel& model) {
  const GradientMap gradient(model, mean);
  cv::Mat1f slope;
  cv::magnitude(gradient.background_gx(), gradient.background_gy(), slope);
  std::vector<float> slopes(slope.begin(), slope.end());
  return quantile_in_place(slopes, 0.5);
}

/// Returns a picture's gray levels as floats. Throws Error when the picture is too small.
cv::Mat3f as_numbers(const cv::Mat3b& mean) {
  constexpr int least_px = 32;
  if (std::min(mean.cols, mean.rows) < least_px)
    throw Error("the background is too small to be judged: less than 32 pixels");
  cv::Mat3f bgr;
  mean.convertTo(bgr, CV_32F);
  return bgr;
}

}  // namespace

double stained_share(const cv::Mat3b& picture) {
  const cv::Mat3f bgr = as_numbers(picture);
  const double pixel = bgr.cols / 320.0;  // sizes below are those of a 320 pixel wide picture
  cv::Mat3f smooth, broad;
  cv::GaussianBlur(bgr, smooth, cv::Size(), 1.5 * pixel, 1.5 * pixel, cv::BORDER_REPLICATE);
  cv::GaussianBlur(smooth, broad, cv::Size(), 12 * pixel, 12 * pixel, cv::BORDER_REPLICATE);
  cv::Mat3f difference;
  cv::subtract(smooth, broad, difference);
  cv::Mat1f length(bgr.size());
  std::transform(difference.begin(), difference.end(), length.begin(),
                 [](const cv::Vec3f& color) { return static_cast<float>(cv::norm(color)); });
  const int border = std::max(1, cvRound(12 * pixel));  // shows lamps and the frame of the gel
  const cv::Rect inside(border, border, bgr.cols - 2 * border, bgr.rows - 2 * border);
  return share_above(length(inside), kStainLevels);
}

std::string judge_lamps(const cv::Mat3b& mean, const std::string& device_name) {
  const cv::Mat3f bgr = as_numbers(mean);
  return is_gelsight_mini(device_name) ? judge_mini_lamps(bgr) : "";
}

std::string judge_orientation(const cv::Mat3b& mean, const std::string& device_name) {
  if (!is_gelsight_mini(device_name)) return "";
  const cv::Mat3f bgr = as_numbers(mean);
  return judge_mini_orientation(red_over_blue(bgr), blue_leads(bgr));
}

std::vector<std::string> judge_background(const cv::Mat3b& picture, const std::string& device_name,
                                          const GradientModel* model, double pixel_pitch_mm) {
  as_numbers(picture);  // throws if the picture is too small
  const auto markers = find_marker_dots(picture);
  const cv::Mat3b mean = MarkerFiller(picture).background();
  const cv::Mat3f bgr = as_numbers(mean);
  std::vector<std::string> warnings;
  const cv::Scalar channels = cv::mean(bgr);
  const double brightness = (channels[0] + channels[1] + channels[2]) / 3;
  if (brightness < kDarkLevel) {
    warnings.push_back(
        fmt::format("the picture is very dark (mean {:.0f} of 255): are the sensor's lamps on, and is the "
                    "exposure right?",
                    brightness));
  }
  const ChannelRange range = channel_range(bgr);
  const double saturated = share_above(range.most, surface::detail::kFullLevel);
  if (saturated > kSpoiltShare) {
    warnings.push_back(
        fmt::format("{:.1f} % of the picture is saturated: shorten the exposure; slopes cannot be read there",
                    100 * saturated));
  }
  if (cv::mean(range.most)[0] - cv::mean(range.least)[0] < kMinColor) {
    // The remaining checks need color.
    warnings.push_back("the picture has no color, from which slopes are read: is it the right camera?");
    return warnings;
  }
  if (markers) warnings.push_back(markers->sentence());
  if (markers && pixel_pitch_mm > 0 && is_gelsight_mini(device_name))
    if (const double times = markers->spacing_px * pixel_pitch_mm / kDotSpacingMm;
        std::abs(times - 1) > kPitchTolerance)
      warnings.push_back(fmt::format(
          "by the markers, {:.1f} mm apart, ppmm is {:.4f}: set it in the configuration; with {:.4f} "
          "lengths are {:.2f} times too {}",
          kDotSpacingMm, pixel_pitch_mm / times, pixel_pitch_mm, std::max(times, 1 / times),
          times > 1 ? "large" : "small"));
  const double stains = markers ? 0.0 : stained_share(mean);
  if (stains > kSpoiltShare) {
    warnings.push_back(
        fmt::format("{:.1f} % of the gel differ sharply from what is around: clean it, and touch nothing for "
                    "the background",
                    100 * stains));
  }
  const std::string lamps = judge_lamps(mean, device_name);
  if (!lamps.empty()) warnings.push_back(lamps);
  if (model != nullptr && model->wide && model->wide->gives_normals) {
    warnings.emplace_back(kMakerModelWarning);
  } else if (model != nullptr && lamps.empty()) {
    const double slope = median_slope(mean, *model);
    if (slope > surface::detail::kBareSlope) {
      warnings.push_back(fmt::format(
          "the model reads the bare gel as sloped ({:.2f}): is it this sensor's? With a new gel or exposure, "
          "calibrate anew",
          slope));
    }
  }
  return warnings;
}

void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_warning) {
  const auto markers = find_marker_dots(background);
  if (markers && !markers->are_readable()) throw Error(name + ": " + markers->sentence());
  const std::string lamps = judge_lamps(background, device_name);
  if (!lamps.empty())
    throw Error(name + ": " + lamps +
                " (take presses and background again, the right way round; if the sensor is no " +
                device_name + ", name it in a configuration)");
  for (const std::string& warning : judge_background(background, device_name))
    say_warning(name + ": " + warning);
}

}  // namespace gelslam
