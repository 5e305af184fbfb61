#include "track_window.hpp"

#include <atomic>
#include <filesystem>
#include <future>

#include "command_line.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

struct AtEnd {
  std::function<void()> run;
  ~AtEnd() { run(); }
};

}  // namespace

void MapWindowArguments::add_to(CLI::App& command) {
  command.add_flag("--window", window,
                   "Show the map and the touch in it while poses are written; a LOG plays at its rate");
  command
      .add_option(
          "--snapshot", snapshot,
          "Picture (PNG) of the window at the end, or, without --window, of the last touch in the map")
      ->check(refuse_unless_png);
  add_overwrite_flag(command, overwrite);
}

WindowOptions MapWindowArguments::window_options() const {
  check_output_file(snapshot, overwrite);
  WindowOptions options;
  options.snapshot = snapshot;
  if (window) viewer::require_display();
  return options;
}

ShownMap read_shown_map(const std::string& folder, const Session& session, ProgressSink& progress) {
  const std::filesystem::path mesh = std::filesystem::path(folder) / "mesh.ply";
  ShownMap map{folder, {}, session.gradient_scale};
  if (std::filesystem::exists(mesh))
    map.mesh = read_mesh(mesh);
  else
    map.mesh = fuse(session.patches, {}, session.gradient_scale, &progress);
  return map;
}

void compute_in_window(const std::function<void()>& compute, const std::function<void()>& stop,
                       const ShownMap& map, LocatedTouches& touches, WindowOptions options) {
  std::atomic<bool> failed = false, closed = false;
  std::future<void> computed = std::async(std::launch::async, [&] {
    try {
      compute();
      touches.have_ended = true;
    } catch (...) {
      if (closed) return;  // stopped before the background was whole
      failed = true;
      throw;
    }
  });
  {
    const AtEnd at_end{[&] {
      closed = true;
      stop();
    }};
    lower_thread_priority();  // drawing goes after locating
    options.asks_to_end = [&failed, asks = std::move(options.asks_to_end)] { return failed || asks(); };
    run_map_window(map, touches, options);
  }
  computed.get();
}

}  // namespace gelslam
