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
  /// The first row of the page, where `rows` fit on one.
  std::size_t first(std::size_t rows, std::size_t all);
  void choose() { close(); }

 protected:
  void act(Action action, double now_s) override;

 private:
  int page_ = 0;
};

/// The window of `gelslam view` without a run: what could be shown, to click on.
class ChooseWindow : public WindowLoop {
 public:
  ChooseWindow(const std::filesystem::path& folder, const std::string& complaint,
               const WindowLoopOptions& options);

  Controls& controls() override { return controls_; }
  const std::optional<std::filesystem::path>& chosen() const { return chosen_; }

 private:
  bool advance(double /*now_s*/, double /*dt_s*/) override { return false; }
  void draw_frame(Ui& ui, double now_s) override;
  void dropped(const std::filesystem::path& path) override { choose(path); }

  void choose(const std::filesystem::path& path);
  void draw_rows(Ui& ui);

  std::filesystem::path folder_;
  std::string complaint_;
  std::vector<Viewable> found_;
  ChooseControls controls_;
  std::optional<std::filesystem::path> chosen_;
};

}  // namespace gelslam::viewer::detail
