#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Upper limit of times on the system's clock, which are stored as microseconds since 1970: the year 2100.
inline constexpr std::int64_t kMaxUnixUs = 4'102'444'800'000'000;

/// Returns the time of a frame in a trajectory: Unix time in s (a double keeps its microseconds) or, if
/// `unix_us` is not known (0), `time_s` since the log's first frame.
inline double stamp_s(std::int64_t unix_us, double time_s) {
  return unix_us == 0 ? time_s : 1e-6 * static_cast<double>(unix_us);
}

/// One line of a trajectory file: the sensor's pose in the map.
struct StampedPose {
  double time_s = 0.0;  ///< stamp_s()
  Pose map_T_sensor = Pose::Identity();
  /// Covariance of the pose's right perturbation; not stored in a TUM file.
  std::optional<Matrix6d> covariance{};
};

/// Reads a TUM trajectory: lines of `time_s x y z qx qy qz qw`, meters, blank lines and lines with `#`
/// skipped. Translations come back in millimeters. Throws Error, naming file and line, when the file cannot
/// be read, a line has not eight finite numbers, a quaternion is not of unit length (within 1 %), or times do
/// not increase.
std::vector<StampedPose> read_tum(const std::filesystem::path& path);

/// Returns one line of a TUM trajectory, with the line end: "time_s tx ty tz qx qy qz qw", meters, 12
/// significant digits (Unix times: microseconds), qw >= 0.
std::string tum_line(double time_s, const Pose& pose_mm);

/// Splits a trajectory where nothing was tracked for more than a quarter of a second.
std::vector<std::vector<Pose>> unbroken_segments(std::span<const StampedPose> trajectory);

/// Writes the covariances of a trajectory as an N x 6 x 6 array in its order: x y z rx ry rz, meters and
/// radians, along the axes of the sensor.
void write_covariances(const std::filesystem::path& npy, const std::vector<StampedPose>& trajectory);
/// Reads covariances into a trajectory. Throws Error when the file belongs to another trajectory or is
/// damaged.
void read_covariances(const std::filesystem::path& npy, std::vector<StampedPose>& trajectory);

/// Returns the contents of a TUM file.
std::string tum_text(const std::vector<StampedPose>& trajectory);

}  // namespace gelslam
