#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

/// Returns the part of a scan (ScanPart) that a log or a camera with this configuration makes. `log` may be
/// empty. Throws Error when the model cannot be read.
ScanPart part_of(const Config& config, const std::filesystem::path& log);

/// Throws Error unless the surfaces in a run's record were computed with the part's model, and at this
/// sensor's pixel pitch and resolution. Surfaces of one scan must share the systematic errors of one model.
void check_same_sensor(const std::filesystem::path& run, const ScanRecord& record, const ScanPart& part,
                       const SensorProfile& sensor);

/// Reads the session of a run folder in order to continue it with this configuration. The `parts` of the
/// result include the new one. Throws Error when there is no session, and as check_same_sensor().
ScanRecord continue_scan(const std::filesystem::path& run, const Config& config,
                         const std::filesystem::path& log);

/// A scan that is continued in its own run folder.
struct ContinuedScan {
  ScanRecord record;
  std::shared_ptr<const FolderLock> lock;
};
/// As continue_scan(), but for continuing in the run folder itself, which is locked before it is read. Throws
/// Error while another program writes to it.
ContinuedScan continue_in_place(const std::filesystem::path& run, const Config& config);

/// Returns one sentence per part of a scan: how many of its trials were joined to the map, and which ones
/// were not. Empty for a scan of one part.
std::vector<std::string> describe_parts(const SlamMap& map);

}  // namespace gelslam
