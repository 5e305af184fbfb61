#include <algorithm>
#include <array>
#include <cstdio>

#include "ui/panels.hpp"

namespace gelslam::viewer::detail {
namespace {

constexpr double padding = 14, label_gap = 4, row_gap = 9, stage_gap = 9;
constexpr std::size_t max_stages = 8;
constexpr float figure_rows = 4;

struct Figure {
  const char* label;
  std::string value;
  ImU32 color = theme::text;
};

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), value < 9.95 ? "%.1f" : "%.0f", value);
  return text.data();
}

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
      {"Keyframes", text_of_count(s.keyframes)},
      {"Loops", text_of_count(s.loops)},
      {"Trials", text_of_count(s.trials)},
      {"Groups", text_of_count(s.components)},
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
  return figure_rows *
         (canvas.fonts().small->FontSize + canvas.fonts().figure->FontSize + canvas.px(row_gap));
}

void draw_figures(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  const WindowFonts& fonts = canvas.fonts();
  const float row = figures_height(canvas) / figure_rows, column = box.width / 3;
  std::size_t i = 0;
  for (const Figure& figure : figures_of(frame)) {
    const float x = box.x + column * static_cast<float>(i % 3), y = box.y + row * static_cast<float>(i / 3);
    canvas.text(fonts.small, x, y, theme::dim, figure.label);
    // A number too wide for its column is better small than cut.
    ImFont* font =
        canvas.width_of(fonts.figure, figure.value) < column - canvas.px(8) ? fonts.figure : fonts.body;
    canvas.text(font, x, y + fonts.small->FontSize, figure.color, figure.value);
    ++i;
  }
}

float stages_height(const Canvas& canvas, std::size_t stages) {
  const float small = canvas.fonts().small->FontSize;
  const std::size_t rows = (std::min(stages, max_stages) + 1) / 2;
  return rows == 0 ? 0 : small + canvas.px(8) + static_cast<float>(rows) * (small + canvas.px(stage_gap));
}

void draw_stage(Canvas& canvas, float x, float y, float width, const StageStatistics& stage,
                const LiveStatus& status) {
  ImFont* font = canvas.fonts().small;
  const double budget_ms = status.rate_hz > 1 ? 1000 / status.rate_hz : 40;
  const auto share = [budget_ms](double ms) {
    return static_cast<float>(std::clamp(ms / budget_ms, 0.0, 1.0));
  };
  // What is not done for every frame may take longer than one.
  const bool too_slow = stage.median_ms > budget_ms && 2 * stage.count > status.frames;
  const std::string time = number_text(stage.median_ms);
  std::string label = stage.stage;
  std::replace(label.begin(), label.end(), '_', ' ');
  const float room = width - canvas.width_of(font, time) - canvas.px(6);
  canvas.text(font, x, y, theme::dim, canvas.fitted(font, label, room, Cut::end));
  canvas.text_right(font, x + width, y, too_slow ? theme::amber : theme::text, time);
  const Box bar{x, y + font->FontSize + canvas.px(1), width, canvas.px(4)};
  canvas.fill(bar, theme::raised, 2);
  canvas.fill({bar.x, bar.y, width * share(stage.p95_ms), bar.height}, theme::with_alpha(theme::blue, 0.35),
              2);
  canvas.fill({bar.x, bar.y, width * share(stage.median_ms), bar.height},
              too_slow ? theme::amber : theme::blue, 2);
}

/// Median of each stage against the time between two frames; a light part reaches to the 95th percentile.
void draw_stages(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  ImFont* font = canvas.fonts().small;
  canvas.text(font, box.x, box.y, theme::dim, "Stages, ms");
  const float top = box.y + font->FontSize + canvas.px(8);
  const float gap = canvas.px(14), column = 0.5F * (box.width - gap),
              row = font->FontSize + canvas.px(stage_gap);
  for (std::size_t i = 0; i < std::min(frame.stages.size(), max_stages); ++i)
    draw_stage(canvas, box.x + (column + gap) * static_cast<float>(i % 2),
               top + row * static_cast<float>(i / 2), column, frame.stages[i], frame.status);
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
    canvas.text_centered(font, box, theme::dim, without);
  }
  return head + box.height;
}

/// Where everything is, once the scan is finished.
void draw_results(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  const WindowFonts& fonts = canvas.fonts();
  float y = box.y;
  canvas.text(fonts.small, box.x, y, theme::dim, "Saved in");
  y += fonts.small->FontSize + canvas.px(label_gap);
  // The whole path, in as many lines as it takes: it is what the person came for.
  y += canvas.text_wrapped(fonts.body, box.x, y, box.width, theme::text, frame.output_folder) + canvas.px(12);
  const float row = fonts.body->FontSize + canvas.px(7);
  for (const ResultFile& file : frame.results) {
    if (y + row > box.bottom()) return;
    const std::string size = file.bytes < 0 ? "" : text_of_bytes(file.bytes);
    const float room = box.width - canvas.width_of(fonts.body, size) - canvas.px(12);
    canvas.text(fonts.body, box.x, y, theme::text, canvas.fitted(fonts.body, file.name, room));
    canvas.text_right(fonts.body, box.right(), y, theme::dim, size);
    y += row;
  }
}

void draw_pictures(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  const float gap = canvas.px(10), each = 0.5F * (box.height - gap);
  const float first = draw_picture(canvas, box.x, box.y, box.width, each, "Touch and contact", frame.tactile,
                                   "no picture yet");
  draw_picture(canvas, box.x, box.y + first + gap, box.width, each, "Normals", frame.normals,
               "no surface yet");
}

/// What is scanned with, and for how long.
void draw_source(Canvas& canvas, const Box& box, const LiveFrame& frame) {
  ImFont* font = canvas.fonts().small;
  const std::string time = text_of_duration(frame.status.age_s);
  const float room = box.width - canvas.width_of(font, time) - canvas.px(10);
  canvas.text(font, box.x, box.y, theme::dim, canvas.fitted(font, frame.status.source, room, Cut::end));
  canvas.text_right(font, box.right(), box.y, theme::text, time);
}

}  // namespace

void draw_side(Canvas& canvas, const Box& side, const LiveFrame& frame) {
  canvas.panel(side, theme::with_alpha(theme::panel, 1), 0);
  const Box inner = side.inset(canvas.px(padding));
  draw_source(canvas, inner, frame);
  const float head = canvas.fonts().small->FontSize + canvas.px(8);
  const float stages = stages_height(canvas, frame.stages.size()), figures = figures_height(canvas);
  const bool with_stages = stages > 0 && inner.height - head - figures - stages > canvas.px(240);
  const float below = figures + (with_stages ? stages : 0);
  const Box upper{inner.x, inner.y + head, inner.width, inner.height - head - below - canvas.px(12)};
  if (frame.words.state == LiveState::finished && !frame.output_folder.empty())
    draw_results(canvas, upper, frame);
  else
    draw_pictures(canvas, upper, frame);
  const float y = inner.bottom() - below;
  draw_figures(canvas, {inner.x, y, inner.width, figures}, frame);
  if (with_stages) draw_stages(canvas, {inner.x, y + figures, inner.width, stages}, frame);
}

}  // namespace gelslam::viewer::detail
