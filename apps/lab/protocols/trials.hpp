#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The folders in a folder, in natural order; none where it is a file.
std::vector<std::filesystem::path> subfolders(const std::filesystem::path& folder);

/// A folder with true_start_T_currs.npy.
struct BenchmarkTrial {
  std::filesystem::path folder;
  std::string name;    ///< the folder's: "avocado1"
  std::string object;  ///< the name without the digits at its end: "avocado"
};

/// Every trial in the given folders and, where such a folder is none itself, in its sub-folders (three
/// levels), in natural order. Throws Error when a folder is missing or holds none.
std::vector<BenchmarkTrial> find_trials(const std::vector<std::filesystem::path>& folders);

/// One frame as a method sees it, and where the sensor truly was.
struct TrialFrame {
  std::int64_t frame = 0;  ///< from the log's start, background counted
  double time_s = 0;
  SurfacePtr surface;
  std::optional<Pose> start_T_frame;  ///< none where nothing touches
};

/// A trial frame by frame: from gradient_maps.npy and contact_masks.npy where it holds both (the public
/// TactileTracking data: one per true pose, no background), else from its video.
class TrialFrames {
 public:
  virtual ~TrialFrames() = default;
  /// Background frames are left out. Nothing at the end.
  virtual std::optional<TrialFrame> next() = 0;
  const Config& config() const { return config_; }

 protected:
  Config config_;
};

/// Throws Error when the trial cannot be read or its parts do not belong together.
std::unique_ptr<TrialFrames> open_trial(const std::filesystem::path& folder);

}  // namespace gelslam
