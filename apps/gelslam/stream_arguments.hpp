#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "gelslam/exchange/http_service.hpp"
#include "gelslam/slam/line_feed.hpp"

namespace gelslam {

/// Options of `track` and `scan` for the output of poses while they are computed.
struct StreamArguments {
  std::string target;  ///< "-": standard output; "": none.
  std::string format = "ndjson";
  ServeOptions serve{};  ///< No address: no service.
  bool surface = false, images = false;

  /// `target` and `format` must contain the command's defaults.
  void add_to(CLI::App& command);
  /// Adds the options of live commands.
  void add_live_to(CLI::App& command);
  bool is_tum() const { return format == "tum"; }

  /// Throws Error when options contradict each other.
  void check() const;
};

/// Adds --serve and --token, also for commands without a stream. Returns the first option.
CLI::Option* add_serve_option(CLI::App& command, ServeOptions& serve);

/// Opens the service; null without an address. Prints on stderr which address to open, in quiet mode only if
/// the user cannot know it otherwise. Throws Error.
std::unique_ptr<HttpService> open_service(const ServeOptions& serve, LineFeed& lines, const MeshFeed* mesh,
                                          bool quiet);

}  // namespace gelslam
