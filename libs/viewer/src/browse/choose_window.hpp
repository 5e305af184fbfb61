#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/viewer/view_window.hpp"
#include "gelslam/viewer/window_loop.hpp"

namespace gelslam::viewer::detail {

class ChooseControls : public Controls {
 public:
  ChooseControls();
  void choose() { close(); }

 protected:
  void act(Action /*close*/, double /*now_s*/) override { close(); }
};

/// A list to click on.
class ChooseWindow : public WindowLoop {
 public:
  ChooseWindow(const Choices& choices, const WindowLoopOptions& options);

  Controls& controls() override { return controls_; }
  const std::optional<std::filesystem::path>& chosen() const { return chosen_; }

 private:
  bool advance(double /*now_s*/, double /*dt_s*/) override { return false; }
  void draw_frame(Ui& ui, double now_s) override;
  void dropped(const std::filesystem::path& path) override { choose(path); }

  void choose(const std::filesystem::path& path);

  Choices choices_;
  ChooseControls controls_;
  std::optional<std::filesystem::path> chosen_;
};

}  // namespace gelslam::viewer::detail
