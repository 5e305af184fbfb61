#include "collect/collect_panels.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace gelslam::viewer::detail {
namespace {

constexpr int enlargement = 3, side = 3;
constexpr double side_width = 360, margin = 20;  // design pixels

void draw_counts(Canvas& canvas, const Box& picture, const CollectView& view) {
  const float width = picture.width / side, height = picture.height / side;
  for (std::size_t zone = 0; zone < view.taken.size(); ++zone) {
    const auto row = static_cast<float>(zone / side), column = static_cast<float>(zone % side);
    const bool misses = view.missing[zone] > 0;
    const std::string words =
        misses ? std::to_string(view.missing[zone]) + " more" : std::to_string(view.taken[zone]);
    const Box label{picture.x + column * width + canvas.px(8), picture.y + row * height + canvas.px(8),
                    canvas.px(misses ? 84 : 40), canvas.px(28)};
    canvas.fill(label, theme::with_alpha(theme::panel, 0.7), 6);
    canvas.text_centered(canvas.fonts().body, label, misses ? theme::amber : theme::green, words);
  }
}

void draw_share(Canvas& canvas, const Box& bar, const CollectView& view) {
  canvas.fill(bar, theme::line, 5);
  const double share = view.wanted > 0 ? std::min(1.0, static_cast<double>(view.presses) / view.wanted) : 0.0;
  Box full = bar;
  full.width *= static_cast<float>(share);
  if (share > 0) canvas.fill(full, view.enough ? theme::green : theme::blue, 5);
}

void draw_side(Canvas& canvas, const Box& box, const CollectView& view) {
  canvas.panel(box, theme::panel);
  const Box inner = box.inset(canvas.px(margin));
  const WindowFonts& fonts = canvas.fonts();
  float y = inner.y;
  const auto paragraph = [&](ImFont* font, ImU32 color, const std::string& words, double gap) {
    if (!words.empty())
      y += canvas.text_wrapped(font, inner.x, y, inner.width, color, words) + canvas.px(gap);
  };
  paragraph(fonts.small, theme::dim, "BALL PRESSES", 6);
  paragraph(fonts.figure, theme::text, std::to_string(view.presses) + " of " + std::to_string(view.wanted),
            10);
  draw_share(canvas, {inner.x, y, inner.width, canvas.px(10)}, view);
  y += canvas.px(34);
  paragraph(fonts.title, view.circle_is_good || view.enough ? theme::green : theme::text, view.headline, 10);
  paragraph(fonts.body, theme::text, view.hint, 18);
  paragraph(fonts.body, theme::amber, view.warning, 18);
  const float keys = inner.bottom() - canvas.px(64);
  canvas.text(fonts.body, inner.x, keys, theme::dim, "U   take the last press back");
  canvas.text(fonts.body, inner.x, keys + canvas.px(30), theme::dim, "Q   end; all presses are kept");
}

/// The largest box of the picture's shape in the middle of a place.
Box fit_picture(const Box& place, float aspect) {
  const float width = std::min(place.width, place.height / aspect), height = width * aspect;
  return {place.x + 0.5F * (place.width - width), place.y + 0.5F * (place.height - height), width, height};
}

}  // namespace

cv::Mat3b collect_picture(const CollectView& view) {
  cv::Mat3b picture;
  if (view.bgr.empty()) return picture;
  cv::resize(view.bgr, picture, cv::Size(), enlargement, enlargement, cv::INTER_LINEAR);
  for (int k = 1; k < side; ++k) {
    const int u = k * picture.cols / side, v = k * picture.rows / side;
    const cv::Scalar line(150, 150, 150);
    cv::line(picture, {u, 0}, {u, picture.rows}, line, 1);
    cv::line(picture, {0, v}, {picture.cols, v}, line, 1);
  }
  if (!view.circle) return picture;
  constexpr int shift = 4, unit = enlargement << shift;  // sub-pixel drawing
  const cv::Point center(static_cast<int>(std::lround((view.circle->u_px + 0.5) * unit)),
                         static_cast<int>(std::lround((view.circle->v_px + 0.5) * unit)));
  const cv::Scalar color = view.circle_is_good ? cv::Scalar(146, 211, 82) : cv::Scalar(75, 184, 245);
  cv::circle(picture, center, static_cast<int>(std::lround(view.circle->radius_px * unit)), color, 2,
             cv::LINE_AA, shift);
  return picture;
}

void draw_collect_panels(Canvas& canvas, const Box& window, const WindowTexture& picture,
                         const CollectView& view) {
  const float gap = canvas.px(margin);
  Box right = window.inset(gap);
  right.width = std::min(canvas.px(side_width), 0.45F * right.width);
  right.x = window.right() - gap - right.width;
  Box left = window.inset(gap);
  left.width = right.x - gap - left.x;
  draw_side(canvas, right, view);
  if (picture.empty()) {
    canvas.text_centered(canvas.fonts().body, left, theme::dim, "Waiting for the first picture");
    return;
  }
  const Box place = fit_picture(left, picture.aspect());
  canvas.image(picture.id(), place);
  draw_counts(canvas, place, view);
}

}  // namespace gelslam::viewer::detail
