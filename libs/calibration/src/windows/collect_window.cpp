#include "windows/collect_window.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

namespace gelslam::calibration::detail {
namespace {

using viewer::Action;
using viewer::Box;
using viewer::Color;
using viewer::Face;
using viewer::Ui;
namespace theme = viewer::theme;

constexpr int kEnlargement = 3, kSide = 3;
constexpr double kCollectSideWidth = 360, kCollectMargin = 20;  // design pixels

void draw_counts(Ui& ui, const Box& picture, const CollectView& view) {
  const float width = picture.width / kSide, height = picture.height / kSide;
  for (std::size_t zone = 0; zone < view.taken.size(); ++zone) {
    const auto row = static_cast<float>(zone / kSide), column = static_cast<float>(zone % kSide);
    const bool misses = view.missing[zone] > 0;
    const Box label{picture.x + column * width + ui.px(8), picture.y + row * height + ui.px(8),
                    ui.px(misses ? 84 : 40), ui.px(28)};
    ui.fill(label, theme::with_alpha(theme::kPanel, 0.7), 6);
    ui.text_centered(
        Face::body, label, misses ? theme::kAmber : theme::kGreen,
        misses ? std::to_string(view.missing[zone]) + " more" : std::to_string(view.taken[zone]));
  }
}

void draw_side(Ui& ui, const Box& box, const CollectView& view, const viewer::Controls& controls) {
  ui.begin_panel("##side", box, kCollectMargin, 10);
  const auto paragraph = [&ui](Face face, Color color, const std::string& text, double gap) {
    if (text.empty()) return;
    ui.paragraph(face, color, text);
    ui.gap(gap);
  };
  const float bottom = ui.room().bottom();
  paragraph(Face::small, theme::kDim, "BALL PRESSES", 6);
  paragraph(Face::figure, theme::kText, std::to_string(view.presses) + " of " + std::to_string(view.wanted),
            10);
  const double share = view.wanted > 0 ? static_cast<double>(view.presses) / view.wanted : 0.0;
  ui.bar(share, 0, view.enough ? theme::kGreen : theme::kBlue, 10);
  ui.gap(24);
  paragraph(Face::title, view.circle_is_good || view.enough ? theme::kGreen : theme::kText, view.headline,
            10);
  paragraph(Face::body, theme::kText, view.hint, 18);
  paragraph(Face::body, theme::kAmber, view.warning, 18);
  float y = bottom - ui.px(30) * static_cast<float>(controls.rows().size()) + ui.px(10);
  for (const viewer::ActionRow& row : controls.rows()) {
    ui.text_at(Face::body, box.x + ui.px(kCollectMargin), y, theme::kDim, row.key + "   " + row.help);
    y += ui.px(30);
  }
  ui.end_panel();
}

/// The largest box of the picture's shape in the middle of a place.
Box fit_picture(const Box& place, float aspect) {
  const float width = std::min(place.width, place.height / aspect), height = width * aspect;
  return {place.x + 0.5F * (place.width - width), place.y + 0.5F * (place.height - height), width, height};
}

}  // namespace

CollectControls::CollectControls(CollectWatch& session)
    : Controls({{Action::undo, "u", "U", "", 0, 0, "take the last press back"},
                {Action::close, "q esc", "Q", "", 0, 0, "end; all presses are kept"}}),
      session_(session) {}

void CollectControls::act(Action action, double /*now_s*/) {
  if (action == Action::undo) session_.take_back();
  if (action == Action::close) close();
}

CollectWindow::CollectWindow(CollectWatch& session, const CollectWindowOptions& options)
    : WindowLoop(options), session_(session), controls_(session) {}

bool CollectWindow::advance(double /*now_s*/, double /*dt_s*/) {
  shown_ = session_.view();
  texture_.set(collect_picture(shown_));
  return true;
}

void CollectWindow::draw_frame(Ui& ui, double /*now_s*/) {
  const Box window = ui.window();
  ui.fill(window, theme::kBackdrop);
  const float gap = ui.px(kCollectMargin);
  Box right = window.inset(gap), left = right;
  right.width = std::min(ui.px(kCollectSideWidth), 0.45F * right.width);
  right.x = window.right() - gap - right.width;
  left.width = right.x - gap - left.x;
  set_view(left);
  draw_side(ui, right, shown_, controls_);
  if (texture_.empty())
    return ui.text_centered(Face::body, left, theme::kDim, "Waiting for the first picture");
  const Box place = fit_picture(left, texture_.aspect());
  ui.image(texture_, place);
  draw_counts(ui, place, shown_);
}

cv::Mat3b collect_picture(const CollectView& view) {
  cv::Mat3b picture;
  if (view.bgr.empty()) return picture;
  cv::resize(view.bgr, picture, cv::Size(), kEnlargement, kEnlargement, cv::INTER_LINEAR);
  for (int k = 1; k < kSide; ++k) {
    const int u = k * picture.cols / kSide, v = k * picture.rows / kSide;
    const cv::Scalar line(150, 150, 150);
    cv::line(picture, {u, 0}, {u, picture.rows}, line, 1);
    cv::line(picture, {0, v}, {picture.cols, v}, line, 1);
  }
  if (!view.circle) return picture;
  constexpr int kShift = 4, kUnit = kEnlargement << kShift;  // sub-pixel drawing
  const cv::Point center(static_cast<int>(std::lround((view.circle->u_px + 0.5) * kUnit)),
                         static_cast<int>(std::lround((view.circle->v_px + 0.5) * kUnit)));
  const cv::Scalar color = view.circle_is_good ? cv::Scalar(146, 211, 82) : cv::Scalar(75, 184, 245);
  cv::circle(picture, center, static_cast<int>(std::lround(view.circle->radius_px * kUnit)), color, 2,
             cv::LINE_AA, kShift);
  return picture;
}

}  // namespace gelslam::calibration::detail

namespace gelslam {

void run_collect_window(CollectWatch& session, const CollectWindowOptions& options) {
  calibration::detail::CollectWindow(session, options).run();
}

void write_collect_snapshot(CollectWatch& session, const CollectWindowOptions& options) {
  CollectWindowOptions hidden = options;
  hidden.visible = false;
  viewer::write_png(options.snapshot, calibration::detail::CollectWindow(session, hidden).picture(0.01));
}

}  // namespace gelslam
