#pragma once

#include <filesystem>
#include <vector>

#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// By how much the second recording started later than the first (s): where the angles by which both sensors
/// turn per second correlate best, at most half a minute. 0 where that correlates about as well, or nothing
/// correlates. Source: own.
double time_offset_s(const ScanRecord& first, const ScanRecord& second);

/// What two records of the same time say of how their sensors are fixed to each other: a constraint wherever
/// both were tracked, five per second. The second sensor's pose is interpolated at the first one's frames;
/// its recording started `second_start_s` later. Nothing where either sensor had no link between keyframes.
/// Source: own.
std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second,
                                           double second_start_s);

/// Reads rig.yaml (docs/file-formats.md): the pose of the second sensor in the first. Throws Error for a file
/// that cannot be read, and for what is no rigid motion.
RigPose read_rig(const std::filesystem::path& file);

}  // namespace gelslam
