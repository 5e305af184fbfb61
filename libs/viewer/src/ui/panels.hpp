#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/slam/live_session.hpp"
#include "gelslam/viewer/scene_style.hpp"
#include "live/window_controls.hpp"
#include "ui/window_canvas.hpp"
#include "ui/window_texture.hpp"

namespace gelslam::viewer::detail {

/// A file of the finished scan; negative bytes for a folder.
struct ResultFile {
  std::string name;
  double bytes = 0;
};

/// All that the panels show, gathered once per frame.
struct LiveFrame {
  LiveStatus status;
  StateWords words;
  std::vector<StageStatistics> stages;
  std::string output_folder;        ///< of the run; empty: nothing is kept
  double disk_free_bytes = -1;      ///< negative: not known
  std::vector<ResultFile> results;  ///< once finished
  std::size_t triangles = 0;
  const WindowTexture* tactile = nullptr;
  const WindowTexture* normals = nullptr;
  std::optional<ColorLegend> legend;
  double mm_per_px = 0;  ///< of the view at its center; 0: no scale bar
  double time_s = 0;     ///< the window's clock
};

/// Where the parts of the window lie; parts for which there is no room are empty.
struct PanelLayout {
  Box view, side, bar;
};
PanelLayout lay_out(const Canvas& canvas, float width_px, float height_px, bool with_panels);

/// All of it, over the view that was drawn before. Buttons go to `controls`.
void draw_panels(Canvas& canvas, const PanelLayout& layout, const LiveFrame& frame, LiveControls& controls);

// The parts, each in its own file.
void draw_banner(Canvas& canvas, const Box& view, const LiveFrame& frame, bool names_folder);
void draw_view_marks(Canvas& canvas, const Box& view, const LiveFrame& frame);
void draw_toasts(Canvas& canvas, const Box& view, const LiveControls& controls);
void draw_side(Canvas& canvas, const Box& side, const LiveFrame& frame);
void draw_bar(Canvas& canvas, const Box& bar, const LiveFrame& frame, LiveControls& controls);
void draw_dialog(Canvas& canvas, const LiveFrame& frame, LiveControls& controls);

}  // namespace gelslam::viewer::detail
