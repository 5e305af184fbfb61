#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string_view>

#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

constexpr float kMapFullScaleDeg = 6.0F;
constexpr std::string_view style =
    "body{font:15px sans-serif;max-width:60em;margin:2em auto;color:#222}table{border-collapse:collapse}"
    "td,th{border:1px solid #ccc;padding:.2em .6em;text-align:right}th{background:#f4f4f4}"
    ".good{color:#0a7d2c}.usable{color:#b86e00}.recalibrate{color:#c00}img{border:1px solid #ccc}";

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
  if (!std::isfinite(value)) return "–";
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string base64(const std::vector<unsigned char>& bytes) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    unsigned group = 0;
    for (std::size_t j = 0; j < 3; ++j) group = group << 8 | (k + j < bytes.size() ? bytes[k + j] : 0U);
    for (std::size_t j = 0; j < 4; ++j)
      text += k + j <= bytes.size() ? letters[group >> (18 - 6 * j) & 63U] : '=';
  }
  return text;
}

std::string picture(const cv::Mat3b& image) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes)) throw Error("cannot encode a picture of the report");
  return "<img src=\"data:image/png;base64," + base64(bytes) + "\" width=\"" + std::to_string(image.cols) +
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

/// White: no error, through yellow to red: six degrees and more; gray: no press.
cv::Mat3b map_picture(const cv::Mat1f& map, const cv::Size& size) {
  cv::Mat3b cells(map.size());
  std::transform(map.begin(), map.end(), cells.begin(), [](float error) {
    if (std::isnan(error)) return cv::Vec3b(200, 200, 200);
    const float share = std::min(1.0F, error / kMapFullScaleDeg);
    return cv::Vec3b(cv::saturate_cast<unsigned char>(255.0F * (1.0F - std::min(1.0F, 2.0F * share))),
                     cv::saturate_cast<unsigned char>(255.0F * std::min(1.0F, 2.0F - 2.0F * share)), 255);
  });
  cv::Mat3b image;
  cv::resize(cells, image, size, 0.0, 0.0, cv::INTER_NEAREST);
  return image;
}

void write_ninths(std::ostream& out, const ModelCheck& check) {
  out << "<table>";
  for (std::size_t row = 0; row < 3; ++row) {
    out << "<tr>";
    for (std::size_t column = 0; column < 3; ++column) {
      const SlopeSums& ninth = check.gains.ninths[3 * row + column];
      out << "<td>x " << number(ninth.gain_x(), 3) << "<br>y " << number(ninth.gain_y(), 3) << "</td>";
    }
    out << "</tr>";
  }
  out << "</table>";
}

void write_slopes(std::ostream& out, const ModelCheck& check) {
  out << "<table><tr><th>slope</th><th>gain</th><th>error (degrees)</th><th>pixels</th></tr>";
  double from = 0.0;
  for (std::size_t k = 0; k < check.gains.by_slope.size(); ++k) {
    const double to = SlopeStatistics::slope_limits[k];
    out << "<tr><td>" << number(from, 2) << " – " << number(to, 2) << "</td><td>"
        << number(check.gains.by_slope[k].gain(), 3) << "</td><td>"
        << number(check.errors.by_slope[k].mean_abs_error_deg(), 2) << "</td><td>"
        << number(check.gains.by_slope[k].pixels, 0) << "</td></tr>";
    from = to;
  }
  out << "</table>";
}

void write_balls(std::ostream& out, const ModelCheck& check) {
  out << "<table><tr><th>ball (mm)</th><th>presses</th><th>median radius (mm)</th><th>error "
         "(%)</th><th>slope "
         "gain</th></tr>";
  for (const DiameterCheck& ball : check.diameters)
    out << "<tr><td>" << number(ball.diameter_mm, 2) << "</td><td>" << ball.presses << "</td><td>"
        << number(ball.median_radius_mm, 3) << "</td><td>" << number(100.0 * ball.radius_error(), 1)
        << "</td><td>" << number(ball.gain, 3) << "</td></tr>";
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
  out << "<!doctype html><meta charset=\"utf-8\"><title>Calibration</title><style>" << style << "</style>\n";
  out << "<h1>Calibration: <span class=\"" << verdict << "\">" << verdict << "</span></h1>\n<p>Model "
      << escaped(model_name) << " on " << check.presses.size() << " presses of "
      << escaped(set.folder.string()) << ".</p>\n";
  if (!check.reasons.empty()) {
    out << "<ul>";
    for (const std::string& reason : check.reasons) out << "<li>" << escaped(reason) << "</li>";
    out << "</ul>\n";
  }
  out << "<p>Mean error of a slope angle " << number(check.errors.all.mean_abs_error_deg(), 2)
      << " degrees; gain x " << number(check.gains.all.gain_x(), 3) << ", y "
      << number(check.gains.all.gain_y(), 3) << " (read over true slope; 1 is unbiased).</p>\n";
  out << "<h2>Where</h2>\n<p>" << picture(coverage_picture(check, set)) << " "
      << picture(map_picture(check.error_map_deg, set.background.size()))
      << "</p>\n<p>Left: the presses. Right: error from white (none) over yellow to red (" << kMapFullScaleDeg
      << " degrees and more); gray: no press. Gradient scale in each ninth of the gel:</p>\n";
  write_ninths(out, check);
  out << "\n<h2>How steep</h2>\n";
  write_slopes(out, check);
  out << "\n<h2>Balls</h2>\n";
  write_balls(out, check);
  out << "\n<h2>Presses</h2>\n";
  write_presses(out, check, set);
  out << "\n";
  write_file_atomically(path, out.str());
}

}  // namespace gelslam
