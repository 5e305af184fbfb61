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

/// What is shown of a scan, or of tracking, and what may be asked of it. Called from any thread; returns at
/// once.
struct WatchedScan {
  std::function<LiveStatus()> status;
  std::function<std::shared_ptr<const FrameReport>()> touch;
  std::function<std::shared_ptr<const MapSnapshot>()> map;
  std::function<void(ScanCommand)> ask;  ///< what refusal() does not refuse
  bool another = false;                  ///< of refusal()
};

/// The scan for browsers and programs: a page, poses as they come, the surface, and what a person may ask of
/// the scan (docs/streaming.md). No client delays it.
class HttpService {
 public:
  virtual ~HttpService() = default;

  std::vector<std::string> urls;  ///< what a person may open, at any address of this machine that is served

  /// What is shown as long as the result lives; its last state stays.
  [[nodiscard]] virtual std::shared_ptr<void> watch(WatchedScan scan) = 0;
  /// Once the lines are closed: who reads them gets a second for the end. Open pages fetch the last mesh: 10
  /// s at most.
  virtual void finish() = 0;
};

struct ServeOptions {
  std::string address;  ///< [HOST:]PORT; 127.0.0.1 without a host, port 0: any free one
  std::string token;    ///< that every request has to name; "": a random one
  bool tum = true;      ///< poses come as TUM, too
};

/// `lines` and `mesh` have to outlive it; without `mesh` there is no surface. Throws Error when it cannot
/// listen there.
std::unique_ptr<HttpService> serve_scan(const ServeOptions& options, LineFeed& lines, const MeshFeed* mesh);

}  // namespace gelslam
