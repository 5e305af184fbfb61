#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "stream_arguments.hpp"

namespace gelslam {

/// Options of `scan` that do not depend on the source of its frames.
struct LiveArguments {
  LogOptions log;
  std::string run_folder, continued, snapshot;
  bool overwrite = false, headless = false, quiet = false;
  std::int64_t keep_free_bytes = 0;
  double seconds = 0;  ///< 0: until the user or the source ends it.
  StreamArguments stream;

  void add_to(CLI::App& command);
  /// Returns the configuration of the sensor whose frames are in this log; empty `log`: a camera.
  Config config(const std::string& log) const;
  /// Returns the options that do not depend on the source of the frames. Reads the session that is continued.
  LiveOptions options(const Config& config) const;
};

/// Runs a scan until it is saved and, with a camera, further scans that the user begins afterwards: RUN-2,
/// RUN-3, ..., each with the background of the previous one. `open` is called for each of them after the run
/// folder and the display have been checked. The first Ctrl-C stops the scan, the second one saves what
/// exists immediately, the third one ends the program. Returns the worst exit code.
int run_live(LiveOptions options, const LiveArguments& arguments, const std::function<CameraInput()>& open);

/// As run_live(), for a log that is replayed like a camera; with `every_frame` as fast as possible without
/// dropped frames.
int run_live_log(const std::string& log, const LiveArguments& arguments, bool every_frame);

}  // namespace gelslam
