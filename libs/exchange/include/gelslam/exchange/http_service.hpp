#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/slam/line_feed.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/mesh_feed.hpp"
#include "gelslam/slam/status_text.hpp"

namespace gelslam {

/// Access to a scan (or to tracking) for the web page. Called from any thread; returns immediately.
struct WatchedScan {
  std::function<LiveStatus()> status;
  std::function<std::shared_ptr<const FrameReport>()> touch;
  std::function<std::shared_ptr<const MapSnapshot>()> map;
  std::function<void(ScanCommand)> ask;  ///< Executes a command that refusal() allows.
  bool another = false;                  ///< Argument of refusal().
};

/// Serves the scan to browsers and programs: a page, the stream of poses, the surface, and commands that a
/// user may give (docs/streaming.md). No client can delay the scan.
class HttpService {
 public:
  virtual ~HttpService() = default;

  /// Addresses that a user may open, one for each served address of this computer.
  std::vector<std::string> urls;

  /// Shows this scan as long as the result exists; afterwards its last state remains.
  [[nodiscard]] virtual std::shared_ptr<void> watch(WatchedScan scan) = 0;
  /// To be called when the lines are closed. Readers of lines get one second for the end of the stream; open
  /// pages get up to 10 s to fetch the last mesh.
  virtual void finish() = 0;
};

struct ServeOptions {
  std::string address;  ///< [HOST:]PORT. Without a host it is 127.0.0.1; port 0 means any free one.
  std::string token;    ///< Token that every request must contain; "": a random one.
  bool tum = true;      ///< Also offer poses in TUM format.
};

/// `lines` and `mesh` must outlive the result; without `mesh` no surface is served. Throws Error when it
/// cannot listen at the address.
std::unique_ptr<HttpService> serve_scan(const ServeOptions& options, LineFeed& lines, const MeshFeed* mesh);

}  // namespace gelslam
