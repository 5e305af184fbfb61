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

/// What a person can do with a live scan: calls to the session, and requests to the window.
class LiveControls : public SceneControls {
 public:
  /// As of WindowOptions.
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

/// All that the panels show.
struct LiveFrame {
  LiveStatus status;
  StateWords words;
  std::string output_folder;          ///< of the run; empty: nothing is kept
  std::int64_t disk_free_bytes = -1;  ///< negative: not known
  Eigen::AlignedBox3f mesh_mm;        ///< in the map's frame
  Texture tactile, normals;           ///< of the touch
};

/// Where the view, the panel beside it and the bar of buttons lie; a small window leaves out panels.
struct Layout {
  Box view, side, bar;
};
Layout lay_out(const Ui& ui, bool shows_panels);
Color color_of(Tone tone);

inline constexpr int kPictureWidthPx = 640;  ///< more than the panel shows, for large screens

/// The camera's picture with the border of the contact drawn over it in green: what the sensor sees, and what
/// counts as touched. BGR, kPictureWidthPx wide. A picture without a surface (before the background is known)
/// is shown as it is.
cv::Mat3b tactile_picture(const cv::Mat3b& image, const Surface* surface);

/// Normals as colors (x red, y green, z blue, as is usual), BGR, as wide; what is not touched is faded toward
/// gray.
cv::Mat3b normal_picture(const Surface& surface);

/// The touch and its normals below each other, as wide as fits into the height.
void draw_pictures(Ui& ui, float height, const LiveFrame& frame);
/// Returns its lower edge.
float draw_banner(Ui& ui, const Box& view, const LiveFrame& frame, double now_s);
void draw_side(Ui& ui, const Box& side, const LiveFrame& frame);
/// What to do first: the gel as the camera sees it, and three steps.
void draw_start(Ui& ui, const Box& view, const LiveFrame& frame);
/// What was made, and how good it is. Returns how much of the view's left it covers, px.
float draw_end(Ui& ui, const Box& view, const LiveFrame& frame);
/// All counters, at the view's upper right.
void draw_diagnostics(Ui& ui, const Box& view, const LiveFrame& frame);

/// The window of a scan, frame by frame: the session as a scene, from which it takes what is new.
class LiveWindow : public SceneLoop {
 public:
  LiveWindow(LiveSession& session, const WindowOptions& options);
  ~LiveWindow() override { host().make_current(); }  // what was drawn with is freed there

  LiveControls& controls() override { return controls_; }
  bool has_side() const { return side_.width > 0; }
  void show_all_at_once();

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(Ui& ui, double now_s) override;
  bool closes_by_itself() override;
  OrbitCamera whole_view(const Viewport& viewport) const override;
  const Scene& scene(std::size_t /*part*/) const override { return scene_; }

  bool poll_updates();  ///< true when something has come that is to be drawn
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
  std::optional<Pose> map_T_touch_;  ///< also in an unjoined component
  bool trajectory_is_old_ = false;
  std::vector<FrameRecord> samples_;  ///< of the sensor's trajectory
  double figures_s_ = -1e9;
  Box side_;
  float covered_px_ = 0, banner_px_ = 0;  ///< on the view's left; at its top
};

}  // namespace gelslam::viewer::detail
