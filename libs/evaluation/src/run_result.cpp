#include "gelslam/evaluation/run_result.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "gelslam/core/error.hpp"
#include "json_file.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMaxLineLength = 4096;   // eight numbers need a tenth of this
constexpr std::size_t kMaxLines = 50'000'000;  // 23 days at 25 Hz
constexpr double kMaxTranslation_m = 1000.0;   // anything beyond is not a touch sensor's path

std::string at_line(const std::filesystem::path& path, std::size_t line_number) {
  return path.string() + ", line " + std::to_string(line_number);
}

/// Exactly eight numbers separated by blanks; false otherwise.
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
  if (translation_m.norm() > kMaxTranslation_m) throw Error(where + ": a position more than 1 km away");
  if (std::abs(rotation.norm() - 1.0) > 0.01) {
    throw Error(where + ": the quaternion (columns 5 to 8, qx qy qz qw) is not of unit length");
  }
  StampedPose pose;
  pose.time_s = n[0];
  pose.map_T_sensor.linear() = rotation.normalized().toRotationMatrix();
  pose.map_T_sensor.translation() = 1000.0 * translation_m;
  return pose;
}

using evaluation::detail::integer_at;

/// `report[key]` where it is an object, else an empty one.
nlohmann::json object_at(const nlohmann::json& report, const char* key) {
  const auto found = report.find(key);
  return found != report.end() && found->is_object() ? *found : nlohmann::json::object();
}

void read_report(const std::filesystem::path& path, RunResult& run) {
  const nlohmann::json report = evaluation::detail::read_json_object(path);
  run.anchor_frame = integer_at(report, "anchor_frame", 0, path);
  run.trials = integer_at(report, "trials", 0, path);
  run.components = integer_at(report, report.contains("components") ? "components" : "groups", 0, path);
  const nlohmann::json frames = object_at(report, "frames");
  const bool all_seen = integer_at(frames, "left_out", 0, path).value_or(0) == 0;
  // A run that was interrupted has seen only the beginning of its log.
  if (report.value("partial", nlohmann::json(false)) != true && all_seen) {
    run.log_frames = integer_at(frames, "total", 0, path);
  }
  if (integer_at(object_at(report, "mesh"), "triangles", 0, path) == 0) run.mesh_path.clear();
}

}  // namespace

std::vector<StampedPose> read_tum(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path)) {
    throw Error("cannot open the trajectory " + path.string() + ": expected a file of TUM lines");
  }
  std::vector<StampedPose> trajectory;
  std::string line;
  for (std::size_t line_number = 1; std::getline(file, line); ++line_number) {
    const std::string where = at_line(path, line_number);
    if (line.size() > kMaxLineLength || line_number > kMaxLines) {
      throw Error(where + ": not a TUM trajectory (a line or the file is too long)");
    }
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::array<double, 8> numbers{};
    if (!parse_numbers(line, numbers)) {
      throw Error(where + ": expected eight finite numbers: time_s x y z qx qy qz qw");
    }
    trajectory.push_back(to_stamped_pose(numbers, where));
    if (trajectory.size() > 1 && trajectory.back().time_s <= trajectory[trajectory.size() - 2].time_s) {
      throw Error(where + ": the time does not increase");
    }
  }
  if (file.bad()) throw Error("cannot read the trajectory " + path.string());
  return trajectory;
}

RunResult read_run(const std::filesystem::path& folder_or_tum) {
  if (!std::filesystem::exists(folder_or_tum)) {
    throw Error("there is no " + folder_or_tum.string() + ": give a run's folder or a .tum file");
  }
  const bool is_folder = std::filesystem::is_directory(folder_or_tum);
  RunResult run;
  run.trajectory = read_tum(is_folder ? folder_or_tum / "trajectory.tum" : folder_or_tum);
  if (run.trajectory.empty()) {
    throw Error("the trajectory of " + folder_or_tum.string() + " is empty: nothing was tracked");
  }
  if (!is_folder) return run;
  if (const auto mesh = folder_or_tum / "mesh.ply"; std::filesystem::exists(mesh)) run.mesh_path = mesh;
  if (const auto report = folder_or_tum / "report.json"; std::filesystem::exists(report))
    read_report(report, run);
  return run;
}

}  // namespace gelslam
