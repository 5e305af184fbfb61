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

/// A folder with true_start_T_currs.npy.
struct BenchmarkTrial {
  std::filesystem::path folder;
  std::string name;    ///< the folder's: "avocado1"
  std::string object;  ///< as meta.json says, else the name without the digits at its end: "avocado"
  int frames = 0;      ///< with or without contact, background not counted
};

/// Every trial in the given folders and, where such a folder is none itself, in its sub-folders (three
/// levels), in natural order. Throws Error when a folder is missing or holds none, or a truth is damaged.
std::vector<BenchmarkTrial> find_trials(const std::vector<std::filesystem::path>& folders);

/// Where a trial's configuration and model come from, as in LogInput; empty: the folder's own.
struct TrialSources {
  std::filesystem::path config, model;
  bool force = false;
};

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
  /// Throws Error when the trial cannot be read or its parts do not belong together.
  TrialFrames(const BenchmarkTrial& trial, const TrialSources& sources);
  ~TrialFrames();
  /// Background frames are left out. Nothing at the end.
  std::optional<TrialFrame> next();
  const Config& config() const;

  struct Source;  ///< what the surfaces are read from

 private:
  std::unique_ptr<Source> source_;
};

}  // namespace gelslam
