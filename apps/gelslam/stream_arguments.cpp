#include "stream_arguments.hpp"

#include <iostream>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

void say_where(const std::string& name) {
  if (name != "-") std::cerr << "streaming to " << name << std::endl;
}

}  // namespace

void StreamArguments::add_to(CLI::App& command) {
  command
      .add_option("--stream", target,
                  "Stream poses while they are computed: - (stdout), unix:PATH or tcp:PORT")
      ->default_str(target);
  command
      .add_option(
          "--stream-format,--format", format,
          "tum: time and pose (meters, in the frame of the first contact) of every frame that has a "
          "pose; after a loss, poses continue once a place is recognized. ndjson: one object per frame")
      ->check(CLI::IsMember({"tum", "ndjson"}))
      ->capture_default_str();
}

void StreamArguments::add_live_to(CLI::App& command) {
  command.add_flag("--stream-surface", surface, "Also stream the points of keyframes and their map (ndjson)");
  command.add_flag("--stream-images", images, "Also stream the sensor's pictures (ndjson)");
}

void StreamArguments::check() const {
  for (const auto& [given, name] : {std::pair(surface, "--stream-surface"), {images, "--stream-images"}}) {
    if (!given) continue;
    if (target.empty()) throw Error(std::string(name) + " needs --stream");
    if (stream_format() == StreamFormat::tum)
      throw Error(std::string(name) + " needs --stream-format ndjson");
  }
}

std::shared_ptr<PoseStream> StreamArguments::open(double gradient_scale_sigma, bool quiet) const {
  check();
  if (target.empty()) return nullptr;
  auto stream = std::make_shared<PoseStream>(
      PoseStream::Options{target, stream_format(), surface, images, gradient_scale_sigma});
  if (!quiet) say_where(stream->name());
  return stream;
}

std::shared_ptr<StreamServer> StreamArguments::open_server(bool quiet) const {
  check();
  if (target == "-") return nullptr;
  auto server = std::make_shared<StreamServer>(
      target, [format = stream_format()](std::int64_t lines) { return dropped_notice(format, lines); });
  if (!quiet) say_where(server->name());
  return server;
}

}  // namespace gelslam
