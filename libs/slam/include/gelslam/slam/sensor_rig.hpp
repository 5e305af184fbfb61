#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// When the second recording started, by the first one's clock: where the angles by which both sensors turn
/// per second correlate best. That is at most half a minute earlier or later, and at the same time where that
/// correlates about as well, or nothing correlates. Source: own.
double start_of_second_s(const ScanRecord& first, const ScanRecord& second);

/// What two records of the same time say of how their sensors are fixed to each other: a constraint wherever
/// both were tracked, five per second. The second sensor's pose is interpolated at the first one's frames.
/// Nothing where either sensor had no link between keyframes. Source: own.
std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second,
                                           double second_start_s);

/// Reads rig.yaml (docs/file-formats.md): the pose of the second sensor in the first; or, of a run folder,
/// the pose that its report states. Throws Error for what cannot be read or tells no pose, and for what is no
/// rigid motion.
RigPose read_rig(const std::filesystem::path& file);

/// The same; nothing where no file is named: the motions tell.
std::optional<RigPose> read_given_rig(const std::filesystem::path& file);

}  // namespace gelslam
