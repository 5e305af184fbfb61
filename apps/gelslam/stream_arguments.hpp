#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "gelslam/exchange/http_service.hpp"
#include "gelslam/slam/line_feed.hpp"

namespace gelslam {

/// Where poses go while they are computed: what `track` and `scan` have in common.
struct StreamArguments {
  std::string target;  ///< "-": standard output; "": none
  std::string format = "ndjson";
  ServeOptions serve{};  ///< no address: none
  bool surface = false, images = false;

  /// `target` and `format` are the command's defaults.
  void add_to(CLI::App& command);
  /// Only of live commands.
  void add_live_to(CLI::App& command);
  bool is_tum() const { return format == "tum"; }

  /// Throws Error when options contradict each other.
  void check() const;
};

/// --serve and --token, also of commands that stream nothing. Returns the first.
CLI::Option* add_serve_option(CLI::App& command, ServeOptions& serve);

/// Null without an address. Says on stderr what to open, when quiet only if nobody else knows. Throws Error.
std::unique_ptr<HttpService> open_service(const ServeOptions& serve, LineFeed& lines, const MeshFeed* mesh,
                                          bool quiet);

}  // namespace gelslam
