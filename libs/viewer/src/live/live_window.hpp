#pragma once

#include <optional>
#include <string>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/status_text.hpp"
#include "gelslam/viewer/controls.hpp"
#include "gelslam/viewer/window.hpp"
#include "live/unjoined_preview.hpp"
#include "ui/scene_loop.hpp"

namespace gelslam::viewer::detail {

/// Controls of a live scan: calls to the session, and requests to the window.
class LiveControls : public SceneControls {
 public:
  /// `keeps_run` and `next_run_folder`: see WindowOptions.
  explicit LiveControls(LiveSession& session, bool keeps_run = true, std::string next_run_folder = "");

  bool shows_diagnostics() const { return shows_diagnostics_; }
  bool wants_new_scan() const { return wants_new_scan_; }
  ButtonLook button(const ActionRow& row) const override;

 protected:
  void act(Action action, double now_s) override;

 private:
  void toggle_pause(double now_s);
  void ask_to_close();
  void ask_for_new_scan(double now_s);

  LiveSession& session_;
  bool keeps_run_, shows_diagnostics_ = false, wants_new_scan_ = false;
  std::string next_run_folder_;
};

/// Data that the panels show.
struct LiveFrame {
  LiveStatus status;
  StateWords words;
  std::string output_folder;          ///< Run folder; empty if nothing is saved.
  std::int64_t disk_free_bytes = -1;  ///< Negative if not known.
  Eigen::AlignedBox3f mesh_mm;        ///< in the map's frame
  Texture tactile, normals;           ///< Images of the touch.
};

/// Positions of the view, the panel beside it and the bar of buttons. A small window has no panels.
struct Layout {
  Box view, side, bar;
};
Layout lay_out(const Ui& ui, bool shows_panels);
Color color_of(Tone tone);

inline constexpr int kPictureWidthPx = 640;  ///< Larger than in the panel, for large screens.

/// Returns the camera's image with the border of the contact in green, BGR, kPictureWidthPx wide. An image
/// without a surface (before the background is known) is returned without a border.
cv::Mat3b tactile_picture(const cv::Mat3b& image, const Surface* surface);

/// Returns normals as colors (x red, y green, z blue, as is usual), BGR, with the same width. Parts without
/// contact are faded to gray.
cv::Mat3b normal_picture(const Surface& surface);

/// Draws the image of the touch and its normals below each other, as wide as the height allows.
void draw_pictures(Ui& ui, float height, const LiveFrame& frame);
/// Returns the lower edge of the banner.
float draw_banner(Ui& ui, const Box& view, const LiveFrame& frame, double now_s);
void draw_side(Ui& ui, const Box& side, const LiveFrame& frame);
/// Draws the first instructions: the gel as the camera sees it, and three steps.
void draw_start(Ui& ui, const Box& view, const LiveFrame& frame);
/// Draws what was saved, and its quality. Returns how many pixels of the view it covers at the left.
float draw_end(Ui& ui, const Box& view, const LiveFrame& frame);
/// Draws all counters at the upper right of the view.
void draw_diagnostics(Ui& ui, const Box& view, const LiveFrame& frame);

/// The window of a live scan, which shows the session as a scene and polls it for changes.
class LiveWindow : public SceneLoop {
 public:
  LiveWindow(LiveSession& session, const WindowOptions& options);
  ~LiveWindow() override { host().make_current(); }  // Frees OpenGL objects, which needs this context.

  LiveControls& controls() override { return controls_; }
  bool has_side() const { return side_.width > 0; }
  void show_all_at_once();

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(Ui& ui, double now_s) override;
  bool closes_by_itself() override;
  OrbitCamera whole_view(const Viewport& viewport) const override;
  const Scene& scene(std::size_t /*part*/) const override { return scene_; }

  bool poll_updates();  ///< Returns true when there is something new to draw.
  void take_touch(const std::shared_ptr<const FrameReport>& touch);
  void place_touch();
  void rebuild_trajectory();
  void look_at_figures(double now_s);
  bool follow_touch(double dt_s);

  LiveSession& session_;
  WindowOptions options_;
  LiveControls controls_;
  LiveFrame frame_;
  Scene scene_;
  std::uint64_t mesh_version_ = 0;
  std::shared_ptr<const FrameReport> touch_;
  std::optional<MapPlace> touch_place_;
  std::shared_ptr<const MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  UnjoinedPreview unjoined_preview_;
  std::optional<Pose> map_T_touch_;  ///< Also for a touch in an unjoined component.
  bool trajectory_is_old_ = false;
  std::vector<FrameRecord> samples_;  ///< Samples of the sensor's trajectory.
  double figures_s_ = -1e9;
  Box side_;
  float covered_px_ = 0, banner_px_ = 0;  ///< Covered parts of the view: at its left, and at its top.
};

}  // namespace gelslam::viewer::detail
