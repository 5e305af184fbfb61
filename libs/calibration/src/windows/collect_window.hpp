#pragma once

#include "gelslam/calibration/collect_window.hpp"
#include "gelslam/viewer/window_loop.hpp"

namespace gelslam::calibration::detail {

class CollectControls : public viewer::Controls {
 public:
  explicit CollectControls(CollectWatch& session);

 protected:
  void act(viewer::Action action, double now_s) override;

 private:
  CollectWatch& session_;
};

/// The window of `gelslam calibrate collect`, frame by frame.
class CollectWindow : public viewer::WindowLoop {
 public:
  CollectWindow(CollectWatch& session, const CollectWindowOptions& options);
  ~CollectWindow() override { host().make_current(); }

  CollectControls& controls() override { return controls_; }

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(viewer::Ui& ui, double now_s) override;
  bool closes_by_itself() override { return shown_.closes; }

  CollectWatch& session_;
  CollectControls controls_;
  CollectView shown_;
  viewer::Texture texture_;
};

}  // namespace gelslam::calibration::detail
