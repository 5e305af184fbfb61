#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "camera_input.hpp"
#include "command_line.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "stream_arguments.hpp"

namespace gelslam {

/// What `scan` takes, whatever its frames come from: of the session, its window or its words in the terminal,
/// and its end.
struct LiveArguments {
  LogOptions log;
  std::string run_folder, continued, snapshot;
  bool overwrite = false, headless = false, quiet = false;
  std::int64_t keep_free_bytes = 0;
  double seconds = 0;  ///< 0: until a person or the source ends it
  StreamArguments stream;

  void add_to(CLI::App& command);
  /// The configuration of the sensor whose frames are in this log; empty: a camera.
  Config config(const std::string& log) const;
  /// The part of the options that does not depend on where frames come from. Reads the session that is
  /// continued.
  LiveOptions options(const Config& config) const;
};

/// Runs a scan until it is saved, and, with a camera, one after another those that the person begins then:
/// RUN-2, RUN-3, ..., each with the background of the one before. `open` is called for each of them, once it
/// is known that the run folder and the display do not refuse. The first Ctrl-C stops it, the second saves at
/// once what there is, the third ends the program. Returns the worst exit code.
int run_live(LiveOptions options, const LiveArguments& arguments, const std::function<CameraInput()>& open);

/// The same of a log, as if it came from a camera; with `every_frame` as fast as possible without a drop.
int run_live_log(const std::string& log, const LiveArguments& arguments, bool every_frame);

}  // namespace gelslam
