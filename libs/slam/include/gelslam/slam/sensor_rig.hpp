#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// How the second recording's clock goes by the first one's: where the angles by which both sensors turn per
/// second correlate best. It starts at most half a minute earlier or later, and at the same time where that
/// correlates about as well, or nothing correlates. Its rate is 1 unless another one, at most 0.3 % off,
/// explains clearly more. Source: own.
SecondClock second_clock(const ScanRecord& first, const ScanRecord& second);

/// A gripper moves the second sensor along a fixed axis.
struct Gripper {
  struct Opening {
    double time_s = 0, mm = 0;
  };
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< of length 1, in the first sensor's frame
  std::vector<Opening> openings;                    ///< by increasing time of the first log; none: 0 mm

  /// Along the first sensor's axes: linear between openings, the first or last one outside of them.
  Eigen::Vector3d moved_mm(double time_s) const;
};

/// What two records of the same time say of how their sensors are fixed to each other: a constraint wherever
/// both were tracked, five per second. The second sensor's pose is interpolated at the first one's frames.
/// Nothing where either sensor had no link between keyframes. Source: own.
std::vector<RigConstraint> rig_constraints(const ScanRecord& first, const ScanRecord& second,
                                           const SecondClock& clock, const Gripper& gripper = {});

struct RigFile {
  RigPose pose;
  Eigen::Vector3d opening_axis = Eigen::Vector3d::UnitZ();
};

/// As the report of a run folder states it. Nothing where it states none.
std::optional<RigPose> rig_of_run(const std::filesystem::path& run);

/// Reads rig.yaml (docs/file-formats.md): the pose of the second sensor in the first, and the axis along
/// which a gripper moves it; or, of a run folder, the pose that its report states. Throws Error for what
/// cannot be read or tells no pose, what is no rigid motion, and an axis not of length 1.
RigFile read_rig(const std::filesystem::path& file);

/// Reads a gripper's openings from a CSV file (docs/file-formats.md). Throws Error, naming file and line.
std::vector<Gripper::Opening> read_openings(const std::filesystem::path& file);

/// What a person tells of two sensors.
struct GivenRig {
  std::optional<RigPose> pose;  ///< of the second sensor in the first; nothing: the motions tell
  Gripper gripper;

  /// The pose at this time of the first log; it must be known.
  RigPose pose_at(double time_s) const;
};

/// read_rig() and read_openings(), where a file is named.
GivenRig read_given_rig(const std::filesystem::path& rig, const std::filesystem::path& openings);

}  // namespace gelslam
