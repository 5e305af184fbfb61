#include "gelslam/viewer/window.hpp"

#include "live/window_live.hpp"
#include "ui/script.hpp"

namespace gelslam {

int run_live_window(LiveSession& session, const WindowOptions& options) {
  viewer::detail::LiveWindow window(session, options);
  window.run();
  return 0;
}

void write_live_snapshot(LiveSession& session, const std::filesystem::path& png,
                         const WindowOptions& options) {
  WindowOptions without_display = options;
  without_display.visible = false;
  without_display.script.clear();
  viewer::detail::LiveWindow window(session, without_display);
  window.turn(0, true);  // takes the session's news, and lays the window out
  window.show_all_at_once();
  viewer::detail::write_png(png.string(), window.picture(0.01));
}

void check_window_script(const std::string& text, const std::string& name) {
  viewer::detail::parse_script(text, name);
}

}  // namespace gelslam
