#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// What two records of the same time say of how their sensors are fixed to each other: a constraint wherever
/// both were tracked, five per second. The second sensor's pose is interpolated at the first one's frames;
/// times of both count from one start. Nothing where either sensor had no link between keyframes. Source:
/// own.
std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second);

/// Reads rig.yaml (docs/file-formats.md): the pose of the second sensor in the first. Throws Error for a file
/// that cannot be read, and for what is no rigid motion.
RigPose read_rig(const std::filesystem::path& file);

}  // namespace gelslam
