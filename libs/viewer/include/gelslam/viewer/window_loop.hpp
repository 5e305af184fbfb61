#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/viewer/controls.hpp"
#include "gelslam/viewer/window_host.hpp"

namespace gelslam::viewer {

/// The event loop of all windows: reads inputs, draws when something has changed, and passes keys and buttons
/// to the window's Controls. Throws Error when there is no display.
class WindowLoop {
 public:
  explicit WindowLoop(const WindowLoopOptions& options)
      : options_(options), host_(options.host ? options.host : std::make_shared<WindowHost>(options)) {}
  virtual ~WindowLoop() = default;

  /// Runs until the user closes the window, or it closes by itself.
  void run();
  /// Runs one iteration at the time `now_s` of the window's clock; with `draw_anyway` it draws even if
  /// nothing has changed. Returns true if it drew; `picture` (may be null) then receives the frame.
  bool turn(double now_s, bool draw_anyway = false, cv::Mat3b* picture = nullptr);
  /// Draws a frame and reads it back.
  cv::Mat3b picture(double now_s);
  bool wants_to_close();

  WindowHost& host() { return *host_; }
  const std::vector<DrawnText>& texts() const { return texts_; }
  /// Returns the area of the view that the panels leave free.
  const Box& view() const { return view_; }
  virtual Controls& controls() = 0;

 protected:
  /// Takes new data and advances animations. Returns true if the window must be redrawn.
  virtual bool advance(double now_s, double dt_s) = 0;
  /// Lays out the window in `ui.window()`, sets the view, and draws the scene and the panels.
  virtual void draw_frame(Ui& ui, double now_s) = 0;
  virtual bool closes_by_itself() { return asks_to_end(); }

  // Mouse events on the view, but not on panels.
  virtual void pressed(int /*button*/, const Eigen::Vector2f& /*at_px*/, double /*now_s*/) {}
  virtual void moved(const Eigen::Vector2f& /*to_px*/) {}
  virtual void released(int /*button*/) {}
  virtual void scrolled(double /*steps*/, const Eigen::Vector2f& /*at_px*/) {}

  bool asks_to_end() const { return options_.asks_to_end && options_.asks_to_end(); }
  void set_view(const Box& view) { view_ = view; }
  void set_picture_folder(const std::filesystem::path& folder) { options_.picture_folder = folder; }

 private:
  void handle_input(double now_s);
  void draw(double now_s, cv::Mat3b* picture);
  void save_screenshot(double now_s);
  bool on_panel() const;

  WindowLoopOptions options_;
  std::shared_ptr<WindowHost> host_;
  Box view_;
  Eigen::Vector2f pointer_px_ = Eigen::Vector2f::Zero();
  double drawn_s_ = -1e9;
  bool input_seen_ = false, draw_next_ = true;
  std::vector<DrawnText> texts_;
  std::vector<Box> panels_;
};

}  // namespace gelslam::viewer
