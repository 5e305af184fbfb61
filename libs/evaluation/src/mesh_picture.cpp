#include "gelslam/evaluation/mesh_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"
#include "mesh_renderer.hpp"

namespace gelslam {
namespace {

using evaluation::detail::Albedo;
using evaluation::detail::Framing;
using evaluation::detail::View;

const cv::Scalar kPaper(250, 249, 249), kInk(70, 62, 58);
const Eigen::Vector3f kClay(0.80F, 0.55F, 0.34F), kStone(0.52F, 0.60F, 0.70F);
constexpr int kTitleHeight_px = 44, kGap_px = 10, kBarWidth_px = 18, kBarMargin_px = 70;

Albedo plain(const Eigen::Vector3f& color) {
  return [color](const RayHit&) { return color; };
}

/// Hershey letters are coarse: drawn four times as large and averaged down they look printed.
void draw_text(cv::Mat& picture, const std::string& text, const cv::Point& left_baseline,
               double scale = 0.55) {
  constexpr int kOversampling = 4;
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kOversampling * scale, 5, &baseline);
  const int margin = 4 * kOversampling;
  cv::Mat large(size.height + baseline + 2 * margin, size.width + 2 * margin, CV_8U, cv::Scalar(0));
  cv::putText(large, text, {margin, margin + size.height}, cv::FONT_HERSHEY_SIMPLEX, kOversampling * scale,
              255, 5, cv::LINE_AA);
  cv::Mat ink;
  cv::resize(large, ink, {large.cols / kOversampling, large.rows / kOversampling}, 0, 0, cv::INTER_AREA);
  const cv::Point corner = left_baseline - cv::Point(margin, margin + size.height) / kOversampling;
  const cv::Rect area = cv::Rect(corner, ink.size()) & cv::Rect({0, 0}, picture.size());
  for (int y = area.y; y < area.br().y; ++y) {
    for (int x = area.x; x < area.br().x; ++x) {
      const int weight = ink.at<std::uint8_t>(y - corner.y, x - corner.x);
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = static_cast<std::uint8_t>((pixel[c] * (255 - weight) + kInk[c] * weight) / 255);
      }
    }
  }
}

int text_width(const std::string& text, double scale = 0.55) {
  int baseline = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 4 * scale, 5, &baseline).width / 4;
}

/// The largest (or, rounding up, smallest) of 1, 2, 5 times a power of ten up to (from) `value`.
double round_number(double value, bool up) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (up && step * power >= value * (1.0 - 1e-9)) return step * power;
  }
  if (up) return 10.0 * power;
  for (const double step : {5.0, 2.0}) {
    if (step * power <= value * (1.0 + 1e-9)) return step * power;
  }
  return power;
}

std::string number_text(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

void draw_scale_bar(cv::Mat& panel, double mm_per_px) {
  const double length_mm = round_number(0.25 * panel.cols * mm_per_px, false);
  const int length_px = static_cast<int>(std::lround(length_mm / mm_per_px));
  const cv::Point left(18, panel.rows - 18);
  cv::rectangle(panel, cv::Rect(left.x, left.y - 3, length_px, 3), kInk, cv::FILLED);
  draw_text(panel, number_text(length_mm) + " mm", {left.x, left.y - 11}, 0.45);
}

/// Panels in a row under their titles, on paper.
cv::Mat compose(const std::vector<cv::Mat>& panels, const std::vector<std::string>& titles,
                int space_right_px) {
  int width = kGap_px + space_right_px;
  for (const cv::Mat& panel : panels) width += panel.cols + kGap_px;
  const int top = titles.empty() ? kGap_px : kTitleHeight_px;
  cv::Mat picture(panels.front().rows + top + kGap_px, width, CV_8UC3, kPaper);
  int x = kGap_px;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    panels[i].copyTo(picture(cv::Rect(x, top, panels[i].cols, panels[i].rows)));
    if (!titles.empty()) {
      draw_text(picture, titles[i], {x + (panels[i].cols - text_width(titles[i])) / 2, top - 15});
    }
    x += panels[i].cols + kGap_px;
  }
  return picture;
}

/// 256 BGR colors for distances from zero to the limit. Turbo without its darkest ends, which look like
/// shadow.
cv::Mat distance_colors() {
  cv::Mat levels(1, 256, CV_8U), colors;
  for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(i) = static_cast<std::uint8_t>(22 + i * 215 / 255);
  cv::applyColorMap(levels, colors, cv::COLORMAP_TURBO);
  return colors;
}

Eigen::Vector3f to_linear_rgb(const cv::Vec3b& bgr) {
  const auto linear = [](std::uint8_t value) { return std::pow(static_cast<float>(value) / 255.0F, 2.2F); };
  return {linear(bgr[2]), linear(bgr[1]), linear(bgr[0])};
}

std::vector<double> vertex_distances(const Mesh& mesh, const TriangleScene& truth) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) points.push_back(vertex.cast<double>());
  std::vector<double> distances;
  for (const ClosestPoint& closest : truth.closest(points)) distances.push_back(closest.distance_mm);
  return distances;
}

double automatic_limit(std::vector<double> distances) {
  const auto high =
      distances.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(distances.size() - 1));
  std::nth_element(distances.begin(), high, distances.end());
  return round_number(std::max(*high, 1e-3), true);
}

Albedo by_distance(const Mesh& mesh, const std::vector<double>& distances, double limit_mm) {
  std::vector<Eigen::Vector3f> colors;
  const cv::Mat table = distance_colors();
  for (int i = 0; i < 256; ++i) colors.push_back(to_linear_rgb(table.at<cv::Vec3b>(i)));
  return [&mesh, &distances, limit_mm, colors](const RayHit& hit) {
    const Eigen::Vector3i& t = mesh.triangles[static_cast<std::size_t>(hit.triangle)];
    const auto at = [&](int k) { return distances[static_cast<std::size_t>(t[k])]; };
    const double distance = (1.0 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2);
    return colors[static_cast<std::size_t>(255.0 * std::clamp(distance / limit_mm, 0.0, 1.0))];
  };
}

void draw_color_bar(cv::Mat& picture, int left_px, double limit_mm) {
  const cv::Mat colors = distance_colors();
  const int height = std::min(300, picture.rows - 2 * kTitleHeight_px);
  const int top = kTitleHeight_px + (picture.rows - kTitleHeight_px - height) / 2;
  for (int y = 0; y < height; ++y) {
    const cv::Vec3b color = colors.at<cv::Vec3b>(255 - y * 255 / (height - 1));
    cv::rectangle(picture, cv::Rect(left_px, top + y, kBarWidth_px, 1), color, cv::FILLED);
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const int y = top + height - 1 - tick * (height - 1) / 4;
    cv::rectangle(picture, cv::Rect(left_px + kBarWidth_px, y, 4, 1), kInk, cv::FILLED);
    draw_text(picture, number_text(0.25 * tick * limit_mm), {left_px + kBarWidth_px + 8, y + 5}, 0.42);
  }
  draw_text(picture, "mm", {left_px, top - 12}, 0.42);
}

/// 1 for a flat patch, 0 for a closed surface.
double one_sidedness(const Mesh& mesh) {
  Eigen::Vector3d vector_area = Eigen::Vector3d::Zero();
  double area = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices_mm[static_cast<std::size_t>(t[k])].cast<double>();
    };
    const Eigen::Vector3d twice_area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    vector_area += twice_area;
    area += twice_area.norm();
  }
  return area > 0.0 ? vector_area.norm() / area : 0.0;
}

}  // namespace

cv::Mat render_comparison(const Mesh& estimate, const Mesh& truth, const PictureOptions& options) {
  const TriangleScene estimate_scene(estimate), truth_scene(truth);
  const View view = evaluation::detail::facing_view(estimate);
  const Framing framing = evaluation::detail::frame(view, estimate, truth, options.panel_width_px);
  const std::vector<double> distances = vertex_distances(estimate, truth_scene);
  const double limit_mm = options.color_limit_mm > 0.0 ? options.color_limit_mm : automatic_limit(distances);
  using evaluation::detail::render;
  std::vector<cv::Mat> panels = {
      render(estimate_scene, view, framing, plain(kClay)), render(truth_scene, view, framing, plain(kStone)),
      render(estimate_scene, view, framing, by_distance(estimate, distances, limit_mm))};
  draw_scale_bar(panels.front(), framing.mm_per_px);
  cv::Mat picture =
      compose(panels, {"reconstruction", "true shape", "distance to the true shape"}, kBarMargin_px);
  draw_color_bar(picture, picture.cols - kBarMargin_px, limit_mm);
  return picture;
}

cv::Mat render_mesh_picture(const Mesh& mesh, int views, const PictureOptions& options) {
  const TriangleScene scene(mesh);
  const View facing = evaluation::detail::facing_view(mesh);
  const double turn_deg = one_sidedness(mesh) > 0.35 ? 50.0 : 120.0;
  std::vector<double> angles_deg = {0.0};
  if (views == 2) angles_deg = {0.0, turn_deg};
  if (views >= 3) angles_deg = {-turn_deg, 0.0, turn_deg};
  Framing common = evaluation::detail::frame(facing, mesh, mesh, options.panel_width_px);
  for (const double angle : angles_deg) {
    const Framing own = evaluation::detail::frame(evaluation::detail::turned(facing, angle), mesh, mesh,
                                                  options.panel_width_px);
    common.mm_per_px = std::max(common.mm_per_px, own.mm_per_px);
    common.height_px = std::max(common.height_px, own.height_px);
  }
  std::vector<cv::Mat> panels;
  for (const double angle : angles_deg) {
    const View view = evaluation::detail::turned(facing, angle);
    Framing framing = evaluation::detail::frame(view, mesh, mesh, options.panel_width_px);
    framing.mm_per_px = common.mm_per_px;
    framing.height_px = common.height_px;
    panels.push_back(evaluation::detail::render(scene, view, framing, plain(kClay)));
  }
  draw_scale_bar(panels.front(), common.mm_per_px);
  return compose(panels, {}, 0);
}

void write_picture(const std::filesystem::path& path, const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", picture, bytes)) throw Error("cannot encode the picture for " + path.string());
  write_file_atomically(path, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace gelslam
