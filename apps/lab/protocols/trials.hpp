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

/// Returns the subfolders of a folder in natural order; none if it is a file.
std::vector<std::filesystem::path> subfolders(const std::filesystem::path& folder);

/// A trial: a folder with true_start_T_currs.npy.
struct BenchmarkTrial {
  std::filesystem::path folder;
  std::string name;    ///< Name of the folder: "avocado1".
  std::string object;  ///< Name without the digits at its end: "avocado".
};

/// Returns every trial among the given folders; a folder that is no trial is searched for trials in its
/// subfolders (three levels). In natural order. Throws Error when a folder is missing or contains none.
std::vector<BenchmarkTrial> find_trials(const std::vector<std::filesystem::path>& folders);

/// A frame as a method gets it, with the true pose of the sensor.
struct TrialFrame {
  std::int64_t frame = 0;  ///< Counted from the start of the log, with the background.
  double time_s = 0;
  SurfacePtr surface;
  std::optional<Pose> start_T_frame;  ///< Empty without contact.
};

/// The frames of a trial: from gradient_maps.npy and contact_masks.npy if it contains both (the public
/// TactileTracking data: one per true pose, no background), else from its video.
class TrialFrames {
 public:
  virtual ~TrialFrames() = default;
  /// Returns the next frame after the background, or nothing at the end.
  virtual std::optional<TrialFrame> next() = 0;
  const Config& config() const { return config_; }

 protected:
  Config config_;
};

/// Throws Error when the trial cannot be read or its parts do not belong together.
std::unique_ptr<TrialFrames> open_trial(const std::filesystem::path& folder);

}  // namespace gelslam
