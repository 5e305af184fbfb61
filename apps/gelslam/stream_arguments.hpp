#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "gelslam/slam/pose_stream.hpp"

namespace gelslam {

/// Where poses go while they are computed: what `track` and `scan` have in common.
struct StreamArguments {
  std::string target;  ///< StreamServer; "": none
  std::string format = "ndjson";
  bool surface = false, images = false;

  /// `target` and `format` are the command's defaults.
  void add_to(CLI::App& command);
  /// Only of live commands.
  void add_live_to(CLI::App& command);
  StreamFormat stream_format() const { return format == "tum" ? StreamFormat::tum : StreamFormat::ndjson; }

  /// Null without a target. Says on stderr where readers connect, unless quiet. Throws Error like
  /// StreamServer, and when options contradict each other.
  std::shared_ptr<PoseStream> open(double gradient_scale_sigma, bool quiet) const;
  /// Only the lines' way out; null for standard output.
  std::shared_ptr<StreamServer> open_server(bool quiet) const;

 private:
  void check() const;
};

}  // namespace gelslam
