#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "gelslam/slam/live_rig.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/window.hpp"
#include "stream_arguments.hpp"

namespace gelslam {

/// What `scan` and `replay` have in common: the session, its window or its words in the terminal, and its
/// end.
struct LiveArguments {
  LogOptions log;
  std::string run_folder, continued, rig, snapshot, script;
  bool overwrite = false, headless = false, quiet = false;
  double ui_scale = 1;
  double seconds = 0;  ///< 0: until a person or the source ends it
  StreamArguments stream;

  void add_to(CLI::App& command);
  /// The configuration of each sensor, whose frames are in these logs; empty names: cameras.
  std::vector<Config> configs(const std::vector<std::string>& logs) const;
  /// The part of each sensor's options that does not depend on where frames come from. Opens the stream and
  /// reads the session that is continued. Where two sensors continue a run, or one continues that of several,
  /// the scan is a new one, in a folder of its own, which joins that run at its end. Throws Error where one
  /// of these arguments is for another number of sensors.
  std::vector<LiveOptions> options(const std::vector<Config>& configs) const;

 private:
  LiveOptions options_of(Config config, int sensor, int sensors) const;
};

/// How the window begins. Throws Error where a session with these options could not: the run folder, the
/// script or the display refuse. Makes nothing, so that it can be asked before a camera is disturbed.
WindowOptions prepare_window(const std::vector<LiveOptions>& options, const LiveArguments& arguments);

/// What follows a scan where there is a camera.
struct NextScans {
  /// Opens the cameras once more for another scan, one by sensor.
  std::function<RawFrameSources()> open;
  std::vector<Config> configs;     ///< by sensor
  std::vector<std::string> go_on;  ///< the command that continues the run whose folder comes next; or empty
};

/// Runs a scan until it is saved, and one after another those that the person begins then: RUN-2, RUN-3, ...,
/// each with the background of the one before. The first Ctrl-C stops it, the second saves at once what there
/// is, the third ends the program. Returns the worst exit code. When the person chose to look at the run or
/// to go on, this program begins anew with those arguments instead, next.go_on and the run folder or "view"
/// and the run folder.
int run_live(RawFrameSources sources, std::vector<LiveOptions> options, const LiveArguments& arguments,
             WindowOptions window, const NextScans& next = {});

}  // namespace gelslam
