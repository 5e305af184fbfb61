#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string_view>

#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

constexpr double kScaleRange = 0.15;    // above and below 1, the ends of the gradient scale's colors
constexpr double kMinCellPixels = 100;  // fewer are noise
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
  for (const PressCheck& press : check.presses)
    draw_circle(image, {press.zone.u_px, press.zone.v_px, press.zone.radius_px}, cv::Scalar(255, 255, 255));
  return image;
}

/// 256 colors, blue over light gray to red: readable when color-blind.
cv::Mat3b scale_colors() {
  cv::Mat3b table(1, 256);
  const cv::Vec3d blue(172, 102, 33), middle(247, 247, 247), red(43, 24, 178);
  for (int k = 0; k < 256; ++k) {
    const double share = std::abs(k - 127.5) / 127.5;
    table(0, k) = (1.0 - share) * middle + share * (k < 128 ? blue : red);
  }
  return table;
}

/// The gradient scale over the gel at the size of its picture; gray where it says nothing. Below it the
/// colors.
std::string scale_figure(const SlopeStatistics& slopes, const cv::Size& size) {
  constexpr double low = 1.0 - kScaleRange, high = 1.0 + kScaleRange;
  const cv::Mat3b table = scale_colors();
  cv::Mat3b cells(SlopeStatistics::kRows, SlopeStatistics::kColumns), image, bar;
  std::transform(slopes.cells.begin(), slopes.cells.end(), cells.begin(), [&](const SlopeSums& cell) {
    if (cell.pixels < kMinCellPixels) return cv::Vec3b(150, 150, 150);
    const double share = (cell.scale() - low) / (high - low);
    return table(0, static_cast<int>(std::lround(255.0 * std::clamp(share, 0.0, 1.0))));
  });
  cv::resize(cells, image, size, 0.0, 0.0, cv::INTER_NEAREST);
  cv::resize(table, bar, cv::Size(size.width, 12), 0.0, 0.0, cv::INTER_NEAREST);
  return fmt::format(
      "<figure>{}<figcaption>Gradient scale: blue reads too flat, red too steep; gray: too few pixels<br>{}"
      "<br>{:.2f} <span style=\"float:right\">{:.2f}</span></figcaption></figure>",
      picture(image), picture(bar), low, high);
}

void write_list(std::ostream& out, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return;
  out << "<ul>";
  for (const std::string& sentence : sentences) out << "<li>" << escaped(sentence) << "</li>";
  out << "</ul>\n";
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
  write_list(out, check.reasons);
  out << "<p>Mean error of a slope angle " << number(check.slopes.all.mean_abs_error_deg(), 2)
      << " degrees; gradient scale (read over true slope; 1 is unbiased) x "
      << number(check.slopes.all.scale_x(), 3) << ", y " << number(check.slopes.all.scale_y(), 3)
      << ".</p>\n";
  write_list(out, check.findings);
  const cv::Size size = set.background.size();
  out << "<h2>Over the gel</h2>\n<figure>" << picture(coverage_picture(check, set))
      << "<figcaption>The presses</figcaption></figure>" << scale_figure(check.slopes, size) << "\n";
  out << "<h2>Balls</h2>\n";
  write_balls(out, check);
  out << "\n<h2>Presses</h2>\n";
  write_presses(out, check, set);
  out << "\n";
  write_file_atomically(path, out.str());
}

}  // namespace gelslam
