#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Times on the system's clock are kept as whole microseconds since 1970; the year 2100 is no such time.
inline constexpr std::int64_t kMaxUnixUs = 4'102'444'800'000'000;

/// The time of a frame in a trajectory: Unix time (a double keeps its microseconds), or, where `unix_us` is
/// not known (0), `time_s` since the log's first frame.
inline double stamp_s(std::int64_t unix_us, double time_s) {
  return unix_us == 0 ? time_s : 1e-6 * static_cast<double>(unix_us);
}

/// One line of a trajectory file: the sensor's pose in the map.
struct StampedPose {
  double time_s = 0.0;  ///< stamp_s()
  Pose map_T_sensor = Pose::Identity();
  std::optional<Matrix6d> covariance{};  ///< of the pose's right perturbation; not in a TUM file
};

/// Reads a TUM trajectory: lines of `time_s x y z qx qy qz qw`, meters, blank lines and lines with `#`
/// skipped. Translations come back in millimeters. Throws Error, naming file and line, when the file cannot
/// be read, a line has not eight finite numbers, a quaternion is not of unit length (within 1 %), or times do
/// not increase.
std::vector<StampedPose> read_tum(const std::filesystem::path& path);

/// One line of a TUM trajectory, with line end: "time_s tx ty tz qx qy qz qw", meters, 12 significant digits
/// (Unix times: microseconds), qw >= 0.
std::string tum_line(double time_s, const Pose& pose_mm);

/// Cut where nothing was tracked for more than a quarter of a second.
std::vector<std::vector<Pose>> unbroken_segments(std::span<const StampedPose> trajectory);

/// The covariances of a trajectory that has them: N x 6 x 6, in its order; x y z rx ry rz, meters and
/// radians, along the axes of the sensor.
void write_covariances(const std::filesystem::path& npy, const std::vector<StampedPose>& trajectory);
/// Adds them to a trajectory. Throws Error where the file is of another one, or damaged.
void read_covariances(const std::filesystem::path& npy, std::vector<StampedPose>& trajectory);

/// The text of a file.
std::string tum_text(const std::vector<StampedPose>& trajectory);

}  // namespace gelslam
