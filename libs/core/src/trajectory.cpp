#include "gelslam/core/trajectory.hpp"

#include <fmt/core.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMaxLineLength = 4096;   // eight numbers need a tenth of this
constexpr std::size_t kMaxLines = 50'000'000;  // 23 days at 25 Hz
constexpr double kMaxTranslationM = 1000.0;    // Larger values do not occur in the path of a tactile sensor.

std::string at_line(const std::filesystem::path& path, std::size_t line_number) {
  return path.string() + ", line " + std::to_string(line_number);
}

/// Reads a line of exactly eight numbers that are separated by blanks; returns false for any other line.
bool parse_numbers(const std::string& line, std::array<double, 8>& numbers) {
  const char* position = line.data();
  const char* const end = line.data() + line.size();
  const auto skip_blanks = [&] {
    while (position != end && (*position == ' ' || *position == '\t' || *position == '\r')) ++position;
  };
  for (double& number : numbers) {
    skip_blanks();
    const auto [next, error] = std::from_chars(position, end, number);
    if (error != std::errc() || !std::isfinite(number)) return false;
    if (next != end && *next != ' ' && *next != '\t' && *next != '\r') return false;
    position = next;
  }
  skip_blanks();
  return position == end;
}

StampedPose to_stamped_pose(const std::array<double, 8>& n, const std::string& where) {
  const Eigen::Vector3d translation_m(n[1], n[2], n[3]);
  const Eigen::Quaterniond rotation(n[7], n[4], n[5], n[6]);
  if (translation_m.norm() > kMaxTranslationM)
    throw Error(where + ": a position more than 1 km away; TUM files are in meters");
  if (std::abs(rotation.norm() - 1.0) > 0.01)
    throw Error(where + ": the quaternion (columns 5 to 8, qx qy qz qw) is not of unit length");
  StampedPose pose;
  pose.time_s = n[0];
  pose.map_T_sensor.linear() = rotation.normalized().toRotationMatrix();
  pose.map_T_sensor.translation() = 1000.0 * translation_m;
  return pose;
}

}  // namespace

std::vector<StampedPose> read_tum(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw Error("cannot open the trajectory " + path.string() + ": expected a file of TUM lines");
  std::vector<StampedPose> trajectory;
  std::string line;
  for (std::size_t line_number = 1; std::getline(file, line); ++line_number) {
    const std::string where = at_line(path, line_number);
    if (line.size() > kMaxLineLength || line_number > kMaxLines)
      throw Error(where + ": not a TUM trajectory (a line or the file is too long)");
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::array<double, 8> numbers{};
    if (!parse_numbers(line, numbers))
      throw Error(where + ": expected eight finite numbers: time_s x y z qx qy qz qw");
    trajectory.push_back(to_stamped_pose(numbers, where));
    if (trajectory.size() > 1 && trajectory.back().time_s <= trajectory[trajectory.size() - 2].time_s)
      throw Error(where + ": the time does not increase");
  }
  if (file.bad()) throw Error("cannot read the trajectory " + path.string());
  return trajectory;
}

std::string tum_line(double time_s, const Pose& pose_mm) {
  Eigen::Quaterniond q(pose_mm.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d t = pose_mm.translation() * 1e-3;
  constexpr double kTwelveDigitsS = 1e6;  // For smaller times, twelve digits include the microseconds.
  return (time_s < kTwelveDigitsS ? fmt::format("{:.12g}", time_s) : fmt::format("{:.6f}", time_s)) +
         fmt::format(" {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g}\n", t.x(), t.y(), t.z(), q.x(),
                     q.y(), q.z(), q.w());
}

std::vector<std::vector<Pose>> unbroken_segments(std::span<const StampedPose> trajectory) {
  constexpr double kGapS = 0.25;
  std::vector<std::vector<Pose>> segments;
  double last_s = 0;
  for (const StampedPose& pose : trajectory) {
    if (segments.empty() || pose.time_s - last_s > kGapS) segments.emplace_back();
    segments.back().push_back(pose.map_T_sensor);
    last_s = pose.time_s;
  }
  return segments;
}

std::string tum_text(const std::vector<StampedPose>& trajectory) {
  std::string text;
  for (const StampedPose& pose : trajectory) text += tum_line(pose.time_s, pose.map_T_sensor);
  return text;
}

void write_covariances(const std::filesystem::path& npy, const std::vector<StampedPose>& trajectory) {
  std::vector<double> numbers;
  for (const StampedPose& pose : trajectory) {
    const Matrix6d covariance = translation_first(pose.covariance.value(), 1e-3);
    numbers.insert(numbers.end(), covariance.data(), covariance.data() + covariance.size());
  }
  write_npy(npy, {trajectory.size(), 6, 6}, numbers);
}

void read_covariances(const std::filesystem::path& npy, std::vector<StampedPose>& trajectory) {
  const NpyArray array = read_npy(npy);
  if (array.shape != std::vector<std::size_t>{trajectory.size(), 6, 6})
    throw Error(npy.string() + ": is of another trajectory");
  const std::vector<double> numbers = array.to_doubles();
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    Matrix6d covariance = translation_first(Matrix6d(numbers.data() + 36 * i));
    covariance.bottomRows<3>() *= 1e3;
    covariance.rightCols<3>() *= 1e3;
    trajectory[i].covariance = covariance;
  }
}

}  // namespace gelslam
