#include "stream_arguments.hpp"

#include <iostream>

#include "gelslam/core/error.hpp"

namespace gelslam {

void StreamArguments::add_to(CLI::App& command) {
  command.add_option("--stream", target, "Stream poses while they are computed: - (stdout)")
      ->default_str(target);
  command
      .add_option(
          "--stream-format,--format", format,
          "tum: time and pose (meters, in the map or in the frame of the first contact) of every frame that "
          "has a "
          "pose; after a loss, poses continue once a place is recognized. ndjson: one object per frame")
      ->check(CLI::IsMember({"tum", "ndjson"}))
      ->capture_default_str();
  add_serve_option(command, serve);
}

void StreamArguments::add_live_to(CLI::App& command) {
  command.add_flag("--stream-surface", surface, "Also stream the points of keyframes and their map (ndjson)");
  command.add_flag("--stream-images", images, "Also stream the sensor's pictures (ndjson)");
}

void StreamArguments::check() const {
  if (!target.empty() && target != "-")
    throw Error("--stream " + target + ": should be -; other programs read --serve [HOST:]PORT");
  for (const auto& [given, name] : {std::pair(surface, "--stream-surface"), {images, "--stream-images"}}) {
    if (!given) continue;
    if (target.empty()) throw Error(std::string(name) + " needs --stream");
    if (is_tum()) throw Error(std::string(name) + " needs --stream-format ndjson");
  }
}

CLI::Option* add_serve_option(CLI::App& command, ServeOptions& serve) {
  const auto refuse_empty = [](const char* instead) {
    return [=](const std::string& text) { return text.empty() ? std::string("give ") + instead : ""; };
  };
  CLI::Option* option =
      command
          .add_option(
              "--serve", serve.address,
              "Serve a page to watch, poses and the surface at [HOST:]PORT (HTTP; without HOST for this "
              "machine only)")
          ->check(refuse_empty("PORT or HOST:PORT"));
  command
      .add_option("--token", serve.token, "Word that clients of --serve have to name (default: a random one)")
      ->needs(option)
      ->check(refuse_empty("a word"));
  return option;
}

std::unique_ptr<HttpService> open_service(const ServeOptions& serve, LineFeed& lines, const MeshFeed* mesh,
                                          bool quiet) {
  if (serve.address.empty()) return nullptr;
  auto service = serve_scan(serve, lines, mesh);
  for (const std::string& url : service->urls)
    if (!quiet || serve.token.empty()) std::cerr << "serving " << url << std::endl;
  return service;
}

}  // namespace gelslam
