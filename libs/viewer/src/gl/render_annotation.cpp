#include "gl/render_annotation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace gelslam::viewer::detail {
namespace {

constexpr int kOversampling = 4;

struct Pen {
  double text_scale;  ///< of the Hershey font
  int unit_px;        ///< distances are multiples of it
  cv::Vec3b ink;
};

Pen pen_for(const cv::Rect& area, bool light_theme) {
  const double scale = std::clamp(area.height / 800.0, 0.6, 4.0);
  return {0.62 * scale, static_cast<int>(std::lround(10 * scale)),
          light_theme ? cv::Vec3b(70, 62, 58) : cv::Vec3b(228, 224, 218)};
}

void blend(cv::Vec3b& pixel, const cv::Vec3b& ink, int weight) {
  for (int c = 0; c < 3; ++c)
    pixel[c] = static_cast<std::uint8_t>((pixel[c] * (255 - weight) + ink[c] * weight) / 255);
}

/// Hershey letters are coarse: drawn four times as large and averaged down they look printed.
void draw_text(cv::Mat3b& picture, const std::string& text, const cv::Point& left_baseline, const Pen& pen) {
  const double scale = kOversampling * pen.text_scale;
  const int thickness = std::max(1, static_cast<int>(std::lround(8.5 * pen.text_scale)));
  int below = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, &below);
  const int margin = 4 * kOversampling;
  cv::Mat1b large(size.height + below + 2 * margin, size.width + 2 * margin, static_cast<std::uint8_t>(0)),
      ink;
  cv::putText(large, text, {margin, margin + size.height}, cv::FONT_HERSHEY_SIMPLEX, scale, 255, thickness,
              cv::LINE_AA);
  cv::resize(large, ink, {large.cols / kOversampling, large.rows / kOversampling}, 0, 0, cv::INTER_AREA);
  const cv::Point corner = left_baseline - cv::Point(margin, margin + size.height) / kOversampling;
  const cv::Rect shown = cv::Rect(corner, ink.size()) & cv::Rect({0, 0}, picture.size());
  for (int y = shown.y; y < shown.br().y; ++y) {
    for (int x = shown.x; x < shown.br().x; ++x)
      blend(picture(y, x), pen.ink, ink(y - corner.y, x - corner.x));
  }
}

int text_width(const std::string& text, const Pen& pen) {
  int below = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kOversampling * pen.text_scale, 5, &below).width /
         kOversampling;
}

/// With as many decimals as tell values apart over a range.
std::string number_text(double value, double range) {
  const int decimals =
      std::clamp(2 - static_cast<int>(std::floor(std::log10(std::max(range, 1e-9)))) - 1, 0, 6);
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

}  // namespace

void draw_title(cv::Mat3b& picture, const cv::Rect& area, const std::string& title, bool light_theme) {
  const Pen pen = pen_for(area, light_theme);
  draw_text(picture, title, area.tl() + cv::Point(2 * pen.unit_px, 3 * pen.unit_px), pen);
}

void draw_legend(cv::Mat3b& picture, const cv::Rect& area, const ColorLegend& legend, bool light_theme) {
  const Pen pen = pen_for(area, light_theme);
  const int u = pen.unit_px, width = std::min(area.width / 2 - 6 * u, 30 * u);
  if (width < 4 * u || area.height < 16 * u || legend.colors_rgb.empty()) return;
  const cv::Rect bar(area.br().x - 4 * u - width, area.br().y - 5 * u, width, (3 * u) / 2);
  for (int x = 0; x < bar.width; ++x) {
    const auto n = legend.colors_rgb.size();
    const auto place = static_cast<std::size_t>((x + 0.5) / bar.width * static_cast<double>(n));
    const auto& [r, g, b] = legend.colors_rgb[std::min(place, n - 1)];
    picture.col(bar.x + x).rowRange(bar.y, bar.br().y).setTo(cv::Vec3b(b, g, r));
  }
  for (int i = 0; i <= 2; ++i) {
    const double share = 0.5 * i;
    const std::string number =
        number_text(legend.min + share * (legend.max - legend.min), legend.max - legend.min);
    const int x = bar.x + static_cast<int>(std::lround(share * bar.width)) - text_width(number, pen) / 2;
    draw_text(picture, number, {x, bar.br().y + (5 * u) / 2}, pen);
  }
  const std::string title = legend.unit.empty() ? legend.title : legend.title + " (" + legend.unit + ")";
  draw_text(picture, title, {bar.x, bar.y - u}, pen);
}

void draw_scale_bar(cv::Mat3b& picture, const cv::Rect& area, double mm_per_px, bool light_theme) {
  const Pen pen = pen_for(area, light_theme);
  const double most_mm = 0.22 * area.width * mm_per_px;
  if (!(most_mm > 1e-9) || !std::isfinite(most_mm)) return;
  const double power = std::pow(10.0, std::floor(std::log10(most_mm)));
  const double length_mm = power * (5 * power <= most_mm ? 5 : 2 * power <= most_mm ? 2 : 1);
  const int u = pen.unit_px, length_px = static_cast<int>(std::lround(length_mm / mm_per_px));
  const cv::Rect bar(area.x + 2 * u, area.br().y - 2 * u - u / 3, length_px, std::max(2, u / 3));
  cv::rectangle(picture, bar, cv::Scalar(pen.ink[0], pen.ink[1], pen.ink[2]), cv::FILLED);
  draw_text(picture, number_text(length_mm, 10 * length_mm) + " mm", bar.tl() - cv::Point(0, u), pen);
}

}  // namespace gelslam::viewer::detail
