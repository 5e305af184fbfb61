#pragma once

#include <vector>

#include "gelslam/viewer/collect_window.hpp"
#include "ui/window_canvas.hpp"
#include "ui/window_host.hpp"
#include "ui/window_texture.hpp"

namespace gelslam::viewer::detail {

/// The window of `gelslam calibrate collect`, frame by frame.
class CollectLoop {
 public:
  CollectLoop(CollectWatch& session, const CollectWindowOptions& options);
  ~CollectLoop() { host_.make_current(); }  // what was drawn with is freed there
  CollectLoop(const CollectLoop&) = delete;
  CollectLoop& operator=(const CollectLoop&) = delete;

  /// Until it is closed.
  void run();
  /// One turn: input, drawing. False when the window is to be closed.
  bool turn();
  /// Draws a frame and reads it back.
  cv::Mat3b picture();

  WindowHost& host() { return host_; }
  const std::vector<DrawnText>& texts() const { return texts_; }

 private:
  bool handle_input();
  void draw(const CollectView& view);

  CollectWatch& session_;
  CollectWindowOptions options_;
  WindowHost host_;
  WindowTexture texture_;
  std::vector<DrawnText> texts_;
};

}  // namespace gelslam::viewer::detail
