#pragma once

#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <string>

#include "gelslam/slam/live_session.hpp"
#include "window_host.hpp"

namespace gelslam::viewer::detail {

/// The blocks of the growing mesh as they came, at full resolution, for exports.
class WindowMesh {
 public:
  void update(const MeshChanges& changes);
  std::size_t triangles() const { return triangles_; }
  /// One mesh of all blocks; vertices on a border between two, which both have, are one again.
  Mesh whole() const;

 private:
  std::map<std::int64_t, Mesh> blocks_;
  std::size_t triangles_ = 0;
};

/// "screenshot_001.png": the first name of this kind that is not taken in the folder.
std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem,
                                const std::string& extension);

/// Writes a mesh (mm) beside the window's drawing, and says what became of it: the sentence for a toast. `ok`
/// is false when the sentence is a complaint.
struct ExportOutcome {
  bool ok = true;
  std::string sentence;
};
/// The same for a picture of the frame now drawn, under a free name in the folder.
ExportOutcome save_picture(WindowHost& host, const std::filesystem::path& folder, const std::string& stem);
std::future<ExportOutcome> export_in_background(Mesh mesh, const std::filesystem::path& path);

}  // namespace gelslam::viewer::detail
