#include <algorithm>
#include <array>
#include <cstdio>

#include "panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double padding = 14, label_gap = 4, row_gap = 9;
constexpr std::size_t max_stages = 8;

struct Figure {
  const char* label;
  std::string value;
  ImU32 colour = theme::text;
};

std::string text_of_rate(double rate_hz) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f Hz", rate_hz);
  return rate_hz > 0 ? text.data() : "-";
}

Figure loss(const char* label, std::int64_t count) {
  return {label, text_of_count(count), count > 0 ? theme::amber : theme::text};
}

std::vector<Figure> figures_of(const LiveFrame& frame) {
  const LiveStatus& s = frame.status;
  const bool disk_low = frame.disk_free_bytes >= 0 && frame.disk_free_bytes < 2e9;
  return {
      {"Rate", text_of_rate(s.rate_hz)},
      {"Latency", text_of_ms(s.latency_ms)},
      {"Time", text_of_duration(s.age_s)},
      {"Keyframes", text_of_count(s.keyframes)},
      {"Loops", text_of_count(s.loops)},
      {"Trials", text_of_count(s.trials)},
      {"Groups", text_of_count(s.groups)},
      {"Frames", text_of_count(s.frames)},
      {"Triangles", text_of_count(static_cast<std::int64_t>(frame.triangles))},
      loss("Camera lost", s.lost_by_camera),
      loss("Dropped", s.dropped),
      loss("Damaged", s.damaged),
      {"Memory", text_of_bytes(s.memory_mb * 1e6)},
      {"Log", s.log_bytes > 0 ? text_of_bytes(static_cast<double>(s.log_bytes)) : "none"},
      {"Disk free", frame.disk_free_bytes < 0 ? "-" : text_of_bytes(frame.disk_free_bytes),
       disk_low ? theme::red : theme::text},
  };
}

float figures_height(const Canvas& canvas) {
  return 5 * (canvas.fonts().small->FontSize + canvas.fonts().figure->FontSize + canvas.px(row_gap));
}

void draw_figures(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  const WindowFonts& fonts = canvas.fonts();
  const float row = figures_height(canvas) / 5, column = box.width / 3;
  std::size_t i = 0;
  for (const Figure& figure : figures_of(frame)) {
    const float x = box.x + column * static_cast<float>(i % 3), y = box.y + row * static_cast<float>(i / 3);
    canvas.text(fonts.small, x, y, theme::dim, figure.label);
    // A number too wide for its column is better small than cut.
    ImFont* font = canvas.width_of(fonts.figure, figure.value) < column ? fonts.figure : fonts.body;
    canvas.text(font, x, y + fonts.small->FontSize, figure.colour, figure.value);
    ++i;
  }
}

float stages_height(const Canvas& canvas, std::size_t stages) {
  const std::size_t rows = (std::min(stages, max_stages) + 1) / 2;
  return static_cast<float>(rows) * (canvas.fonts().small->FontSize + canvas.px(9));
}

/// Median of each stage against the time between two frames; a light mark for the 95th percentile.
void draw_stages(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  ImFont* font = canvas.fonts().small;
  const double budget_ms = frame.status.rate_hz > 1 ? 1000 / frame.status.rate_hz : 40;
  const float gap = canvas.px(14), column = 0.5F * (box.width - gap), row = font->FontSize + canvas.px(9);
  for (std::size_t i = 0; i < std::min(frame.stages.size(), max_stages); ++i) {
    const StageStatistics& stage = frame.stages[i];
    const float x = box.x + (column + gap) * static_cast<float>(i % 2),
                y = box.y + row * static_cast<float>(i / 2);
    const auto share = [&](double ms) { return static_cast<float>(std::clamp(ms / budget_ms, 0.0, 1.0)); };
    const std::string time = text_of_ms(stage.median_ms);
    std::string label = stage.stage;
    std::replace(label.begin(), label.end(), '_', ' ');
    canvas.text(font, x, y, theme::dim,
                canvas.fitted(font, label, column - canvas.width_of(font, time) - canvas.px(6)));
    canvas.text_right(font, x + column, y, theme::text, time);
    const Box bar{x, y + font->FontSize + canvas.px(1), column, canvas.px(4)};
    canvas.fill(bar, theme::raised, 2);
    canvas.fill({bar.x, bar.y, bar.width * share(stage.p95_ms), bar.height},
                theme::with_alpha(theme::blue, 0.35), 2);
    canvas.fill({bar.x, bar.y, bar.width * share(stage.median_ms), bar.height},
                stage.median_ms > budget_ms ? theme::amber : theme::blue, 2);
  }
}

/// A picture under its name, as wide as fits into width and height; returns the height used.
float draw_picture(Canvas& canvas, float x, float y, float width, float height, const char* label,
                   const WindowTexture* picture, const char* without) {
  ImFont* font = canvas.fonts().small;
  const float head = font->FontSize + canvas.px(label_gap);
  canvas.text(font, x, y, theme::dim, label);
  const bool there = picture != nullptr && !picture->empty();
  const float aspect = there ? picture->aspect() : 0.75F;
  const float shown_width = std::min(width, (height - head) / aspect);
  const Box box{x, y + head, shown_width, shown_width * aspect};
  if (there) {
    canvas.image(picture->id(), box);
  } else {
    canvas.fill(box, theme::raised, 6);
    canvas.text_centred(font, box, theme::dim, without);
  }
  return head + box.height;
}

}  // namespace

void draw_side(Canvas& canvas, const Box& side, const LiveFrame& frame) {
  canvas.panel(side, theme::with_alpha(theme::panel, 1), 0);
  const Box inner = side.inset(canvas.px(padding));
  ImFont* small = canvas.fonts().small;
  const float source_height = small->FontSize + canvas.px(8);
  canvas.text(small, inner.x, inner.y, theme::dim, canvas.fitted(small, frame.status.source, inner.width));

  const float stages = stages_height(canvas, frame.stages.size()), figures = figures_height(canvas);
  const float room = inner.height - source_height - figures - canvas.px(12);
  const bool with_stages = stages > 0 && room - stages > canvas.px(220);
  const float pictures = room - (with_stages ? stages : 0);
  const float each = 0.5F * (pictures - canvas.px(10));

  float y = inner.y + source_height;
  y += draw_picture(canvas, inner.x, y, inner.width, each, "Touch and contact", frame.tactile,
                    "no picture yet");
  y += canvas.px(10);
  draw_picture(canvas, inner.x, y, inner.width, each, "Normals", frame.normals, "no surface yet");

  y = inner.bottom() - figures - (with_stages ? stages : 0);
  draw_figures(canvas, {inner.x, y, inner.width, figures}, frame);
  if (with_stages) draw_stages(canvas, {inner.x, y + figures, inner.width, stages}, frame);
}

}  // namespace gelslam::viewer::detail
