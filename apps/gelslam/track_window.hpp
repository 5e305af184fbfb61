#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "gelslam/slam/store.hpp"
#include "gelslam/viewer/map_window.hpp"

namespace gelslam {

/// How `track` shows the map that it locates the sensor in.
struct MapWindowArguments {
  bool window = false, overwrite = false;
  std::string snapshot;

  void add_to(CLI::App& command);
  bool shows_map() const { return window || !snapshot.empty(); }
  /// Throws Error where the snapshot is refused or there is no display.
  WindowOptions window_options() const;
};

/// The mesh in a map's folder; where there is none, the fused surfaces of `session`. Throws Error.
ShownMap read_shown_map(const std::string& folder, const Session& session, ProgressSink& progress);

/// Shows `touches` while `compute` runs on a thread of its own, which never waits for the window. `stop` must
/// make `compute` return soon; it is called when the window has been closed. Throws what `compute` threw,
/// unless it was stopped before it could begin.
void compute_in_window(const std::function<void()>& compute, const std::function<void()>& stop,
                       const ShownMap& map, LocatedTouches& touches, WindowOptions options);

}  // namespace gelslam
