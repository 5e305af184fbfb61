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

/// The part that a log or a camera with this configuration makes. `log` may be empty. Throws Error when the
/// model cannot be read.
ScanPart part_of(const Config& config, const std::filesystem::path& log);

/// Throws Error unless the surfaces of a run's record were read by the part's model, at this sensor's pitch
/// and resolution: only surfaces that err alike belong to one scan.
void check_same_sensor(const std::filesystem::path& run, const ScanRecord& record, const ScanPart& part,
                       const SensorProfile& sensor);

/// Reads the session of a run folder to continue it with this configuration: `parts` includes the new one.
/// Throws Error when there is none, and as check_same_sensor().
ScanRecord continue_scan(const std::filesystem::path& run, const Config& config,
                         const std::filesystem::path& log);

/// A scan that goes on in its run folder.
struct ContinuedScan {
  ScanRecord record;
  std::shared_ptr<const FolderLock> lock;
};
/// The same to go on in the run folder itself, which is locked before it is read: throws Error while another
/// program writes to it.
ContinuedScan continue_in_place(const std::filesystem::path& run, const Config& config);

/// What became of each part, a sentence each: how many of its trials joined the map, and which did not. Empty
/// for a scan of one part.
std::vector<std::string> describe_parts(const SlamMap& map);

}  // namespace gelslam
