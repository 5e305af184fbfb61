#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string_view>

#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

constexpr double kErrorScaleDeg = 6.0;  // the end of the error map's colors
constexpr double kScaleRange = 0.15;    // above and below 1, the ends of the gradient scale's colors
constexpr std::string_view kStyle =
    "body{font:15px sans-serif;max-width:60em;margin:2em auto;color:#222}table{border-collapse:collapse}"
    "td,th{border:1px solid #ccc;padding:.2em .6em;text-align:right}th{background:#f4f4f4}"
    ".good{color:#0a7d2c}.usable{color:#b86e00}.recalibrate{color:#c00}img{border:1px solid #ccc}"
    "figure{display:inline-block;margin:0 1em 1em 0;vertical-align:top}figcaption{font-size:13px}";

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else
      result += c;
  }
  return result;
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "–";
}

std::string picture(const cv::Mat3b& image) {
  const std::vector<std::uint8_t> bytes = encode_png(image);
  const std::string_view encoded(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return "<img src=\"data:image/png;base64," + base64(encoded) + "\" width=\"" + std::to_string(image.cols) +
         "\">";
}

/// Where the balls were pressed.
cv::Mat3b coverage_picture(const ModelCheck& check, const PressSet& set) {
  cv::Mat3b image = set.background.clone();
  constexpr int shift = 4, unit = 1 << shift;  // sub-pixel drawing
  for (const PressCheck& press : check.presses) {
    const cv::Point center(static_cast<int>(std::lround(press.zone.u_px * unit)),
                           static_cast<int>(std::lround(press.zone.v_px * unit)));
    cv::circle(image, center, static_cast<int>(std::lround(press.zone.radius_px * unit)),
               cv::Scalar(255, 255, 255), 1, cv::LINE_AA, shift);
  }
  return image;
}

/// 256 colors: viridis for magnitudes; for signed values blue over light gray to red. Both are readable when
/// color-blind.
cv::Mat3b color_table(bool is_signed) {
  cv::Mat1b steps(1, 256);
  std::iota(steps.begin(), steps.end(), static_cast<unsigned char>(0));
  cv::Mat3b table;
  cv::applyColorMap(steps, table, cv::COLORMAP_VIRIDIS);
  if (!is_signed) return table;
  const cv::Vec3d blue(172, 102, 33), middle(247, 247, 247), red(43, 24, 178);
  for (int k = 0; k < 256; ++k) {
    const double share = std::abs(k - 127.5) / 127.5;
    table(0, k) = (1.0 - share) * middle + share * (k < 128 ? blue : red);
  }
  return table;
}

struct MapScale {
  double low = 0.0, high = 1.0;
  bool is_signed = false;
};

/// A map of the gel's cells at the size of the gel's picture; gray where it says nothing. Below it the scale.
std::string map_figure(const cv::Mat1f& map, const cv::Size& size, const MapScale& scale,
                       std::string_view caption) {
  const cv::Mat3b table = color_table(scale.is_signed);
  cv::Mat3b cells(map.size()), image, bar;
  std::transform(map.begin(), map.end(), cells.begin(), [&](float value) {
    if (std::isnan(value)) return cv::Vec3b(150, 150, 150);
    const double share = (static_cast<double>(value) - scale.low) / (scale.high - scale.low);
    return table(0, static_cast<int>(std::lround(255.0 * std::clamp(share, 0.0, 1.0))));
  });
  cv::resize(cells, image, size, 0.0, 0.0, cv::INTER_NEAREST);
  cv::resize(table, bar, cv::Size(size.width, 12), 0.0, 0.0, cv::INTER_NEAREST);
  return fmt::format(
      "<figure>{}<figcaption>{}<br>{}<br>{:.2f} <span style=\"float:right\">{:.2f}</span>"
      "</figcaption></figure>",
      picture(image), caption, picture(bar), scale.low, scale.high);
}

/// The gradient scale over steepness, along x and y, as an inline drawing.
std::string scale_curve(const ModelCheck& check) {
  constexpr double width = 520.0, height = 260.0, left = 50.0, bottom = 40.0, low = 0.7, high = 1.3;
  constexpr auto& limits = SlopeStatistics::kSlopeLimits;
  const auto x = [&](double slope) { return left + (width - left - 10.0) * slope / limits.back(); };
  const auto y = [&](double scale) {
    return (height - bottom) * (high - std::clamp(scale, low, high)) / (high - low) + 5.0;
  };
  std::string svg = fmt::format(
      "<svg id=\"scale-curve\" width=\"{}\" height=\"{}\" font-size=\"12\" font-family=\"sans-serif\">",
      width, height);
  for (const double scale : {0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3})
    svg += fmt::format(
        "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/><text x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{:.1f}</text>",
        left, width - 10.0, y(scale), y(scale), scale == 1.0 ? "#222" : "#ddd", left - 6.0, y(scale) + 4.0,
        scale);
  for (const double slope : limits)
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.2f}</text>", x(slope),
                       height - bottom + 22.0, slope);
  svg += fmt::format("<text x=\"{}\" y=\"{}\">steepness (slope)</text>", left, height - 2.0);
  constexpr std::array<const char*, 2> colors = {"#0072b2", "#d55e00"}, names = {"x", "y"};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::string points;
    double from = 0.0;
    for (std::size_t k = 0; k < limits.size(); ++k) {
      const SlopeSums& sums = check.slopes.by_slope[k];
      const double scale = axis == 0 ? sums.scale_x() : sums.scale_y(), middle = 0.5 * (from + limits[k]);
      from = limits[k];
      if (!std::isfinite(scale)) continue;
      points += fmt::format("{:.1f},{:.1f} ", x(middle), y(scale));
      svg += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"><title>{} {:.3f}</title></circle>",
          x(middle), y(scale), colors[axis], names[axis], scale);
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/><text x=\"{}\" y=\"20\" "
        "fill=\"{}\">along {}</text>",
        points, colors[axis], axis == 0 ? "" : " stroke-dasharray=\"6 3\"",
        width - 130.0 + 65.0 * static_cast<double>(axis), colors[axis], names[axis]);
  }
  return svg + "</svg>";
}

void write_slopes(std::ostream& out, const ModelCheck& check) {
  out << "<table><tr><th>slope</th><th>gradient scale</th><th>error (degrees)</th><th>pixels</th></tr>";
  double from = 0.0;
  for (std::size_t k = 0; k < check.slopes.by_slope.size(); ++k) {
    const double to = SlopeStatistics::kSlopeLimits[k];
    out << "<tr><td>" << number(from, 2) << " – " << number(to, 2) << "</td><td>"
        << number(check.slopes.by_slope[k].scale(), 3) << "</td><td>"
        << number(check.slopes.by_slope[k].mean_abs_error_deg(), 2) << "</td><td>"
        << number(check.slopes.by_slope[k].pixels, 0) << "</td></tr>";
    from = to;
  }
  out << "</table>";
}

void write_balls(std::ostream& out, const ModelCheck& check) {
  out << "<table><tr><th>ball (mm)</th><th>presses</th><th>median radius (mm)</th><th>error (%)</th></tr>";
  for (const DiameterCheck& ball : check.diameters)
    out << "<tr><td>" << number(ball.diameter_mm, 2) << "</td><td>" << ball.presses << "</td><td>"
        << number(ball.median_radius_mm, 3) << "</td><td>" << number(100.0 * ball.radius_error(), 1)
        << "</td></tr>";
  out << "</table>";
}

void write_presses(std::ostream& out, const ModelCheck& check, const PressSet& set) {
  out << "<table><tr><th>press</th><th>ball (mm)</th><th>at (px)</th><th>error (degrees)</th><th>radius "
         "(mm)</th></tr>";
  for (const PressCheck& press : check.presses) {
    const CalibrationPress& source = set.presses[press.zone.press];
    out << "<tr><td>" << escaped(source.name) << "</td><td>" << number(source.diameter_mm, 2) << "</td><td>"
        << number(press.zone.u_px, 1) << ", " << number(press.zone.v_px, 1) << "</td><td>"
        << number(press.mean_abs_error_deg, 2) << "</td><td>"
        << (press.radius_mm ? number(*press.radius_mm, 3) : std::string("no ball")) << "</td></tr>";
  }
  out << "</table>";
}

}  // namespace

void write_check_report(const std::filesystem::path& path, const ModelCheck& check, const PressSet& set,
                        const std::string& model_name) {
  std::ostringstream out;
  const char* verdict = verdict_name(check.verdict);
  out << "<!doctype html><meta charset=\"utf-8\"><title>Calibration</title><style>" << kStyle << "</style>\n";
  out << "<h1>Calibration: <span class=\"" << verdict << "\">" << verdict << "</span></h1>\n<p>Model "
      << escaped(model_name) << " on " << check.presses.size() << " presses of "
      << escaped(set.folder.string()) << ".</p>\n";
  if (!check.reasons.empty()) {
    out << "<ul>";
    for (const std::string& reason : check.reasons) out << "<li>" << escaped(reason) << "</li>";
    out << "</ul>\n";
  }
  out << "<p>Mean error of a slope angle " << number(check.slopes.all.mean_abs_error_deg(), 2)
      << " degrees; gradient scale (read over true slope; 1 is unbiased) x "
      << number(check.slopes.all.scale_x(), 3) << ", y " << number(check.slopes.all.scale_y(), 3)
      << ".</p>\n";
  const cv::Size size = set.background.size();
  out << "<h2>Over the gel</h2>\n<figure>" << picture(coverage_picture(check, set))
      << "<figcaption>The presses</figcaption></figure>"
      << map_figure(check.error_map_deg, size, {0.0, kErrorScaleDeg, false},
                    "Mean error of the slope angle, degrees; gray: no press")
      << map_figure(check.scale_map, size, {1.0 - kScaleRange, 1.0 + kScaleRange, true},
                    "Gradient scale: blue reads too flat, red too steep; gray: too few pixels")
      << "\n<h2>Over steepness</h2>\n"
      << scale_curve(check) << "\n";
  write_slopes(out, check);
  out << "\n<h2>Balls</h2>\n";
  write_balls(out, check);
  out << "\n<h2>Presses</h2>\n";
  write_presses(out, check, set);
  out << "\n";
  write_file_atomically(path, out.str());
}

}  // namespace gelslam
