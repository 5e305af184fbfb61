#pragma once

#include <string>

#include "gelslam/slam/live_session.hpp"
#include "gelslam/viewer/controls.hpp"

namespace gelslam::viewer::detail {

/// What a person can do with a live scan: calls to the session, and wishes for the window.
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

}  // namespace gelslam::viewer::detail
