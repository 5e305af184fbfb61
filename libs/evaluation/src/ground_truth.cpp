#include "gelslam/evaluation/ground_truth.hpp"

#include <yaml-cpp/yaml.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/npy.hpp"

namespace gelslam {
namespace {

constexpr double kMillimetersPerMeter = 1000.0;
constexpr double kMaxFps = 10'000.0;
constexpr std::size_t kMaxBytes = 64U << 20;

/// Parses a file that contains one JSON object (at most 64 MB).
nlohmann::json read_json_object(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  if (text.size() > kMaxBytes)
    throw Error(path.string() + " is too large for what it should hold (over 64 MB)");
  nlohmann::json object = nlohmann::json::parse(text, nullptr, false);
  if (!object.is_object()) throw Error(path.string() + " does not hold a JSON object: is it cut off?");
  return object;
}

/// Returns the number at `key`, or nothing if the key is absent. Throws Error when it is not a finite number
/// between `low` and `high`.
std::optional<double> number_at(const nlohmann::json& object, const std::string& key, double low, double high,
                                const std::filesystem::path& path) {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return std::nullopt;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!(value >= low && value <= high))
    throw Error(path.string() + ": " + key + " is not a number from " + nlohmann::json(low).dump() + " to " +
                nlohmann::json(high).dump());
  return value;
}

/// As number_at(), for an integer.
std::optional<int> count_at(const nlohmann::json& object, const std::string& key,
                            const std::filesystem::path& path) {
  const auto value = number_at(object, key, 0, std::numeric_limits<int>::max(), path);
  if (!value) return std::nullopt;
  if (*value != std::floor(*value)) throw Error(path.string() + ": " + key + " is not a whole number");
  return static_cast<int>(*value);
}

/// Converts a 4 x 4 matrix of 16 row-major numbers, meters to millimeters. Throws Error when it is not a
/// rigid motion.
Pose to_pose(const double* numbers, const std::string& what) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = matrix.allFinite() && (rotation * rotation.transpose()).isIdentity(1e-3) &&
                     rotation.determinant() > 0.0 &&
                     matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-6);
  if (!rigid) throw Error(what + " is not a rigid motion (rotation, translation, last row 0 0 0 1)");
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = kMillimetersPerMeter * matrix.topRightCorner<3, 1>();
  return normalized(pose);
}

std::vector<std::optional<Pose>> read_poses(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw Error("there is no " + path.string() + ": this folder has no ground truth to compare with");
  const NpyArray array = read_npy(path);
  if (array.shape.size() != 3 || array.shape[1] != 4 || array.shape[2] != 4)
    throw Error(path.string() + ": expected an array of shape N x 4 x 4");
  const std::vector<double> values = array.to_doubles();
  std::vector<std::optional<Pose>> poses(array.shape[0]);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double* numbers = values.data() + 16 * i;
    if (std::any_of(numbers, numbers + 16, [](double n) { return std::isnan(n); })) continue;
    poses[i] = to_pose(numbers, path.string() + ", pose " + std::to_string(i));
  }
  if (std::none_of(poses.begin(), poses.end(), [](const auto& pose) { return pose.has_value(); }))
    throw Error(path.string() + " holds no pose at all (only NaN): nothing ever touches");
  return poses;
}

Pose read_matrix(const nlohmann::json& rows, const std::string& what) {
  std::vector<double> numbers;
  for (const auto& number : rows.flatten())
    numbers.push_back(number.is_number() ? number.get<double>() : std::nan(""));
  if (rows.size() != 4 || numbers.size() != 16) throw Error(what + " is not a 4 x 4 matrix");
  return to_pose(numbers.data(), what);
}

void read_meta(const std::filesystem::path& path, GroundTruth& truth) {
  const nlohmann::json meta = read_json_object(path);
  if (const auto count = count_at(meta, "background_frames", path)) truth.background_frames = *count;
  if (const auto fps = number_at(meta, "fps", 1e-3, kMaxFps, path)) truth.fps = *fps;
  if (meta.contains("start_T_object"))
    truth.object_T_start = read_matrix(meta["start_T_object"], path.string() + ": start_T_object").inverse();
  const auto frames = count_at(meta, "frames", path);
  if (frames && *frames - truth.background_frames != static_cast<int>(truth.start_T_currs.size()))
    throw Error("the truth beside " + path.string() + " has " + std::to_string(truth.start_T_currs.size()) +
                " poses, but the log has " + std::to_string(*frames) + " frames, " +
                std::to_string(truth.background_frames) + " of them background: it belongs to another log");
}

/// Folders of the public layout have no meta.json; their frame rate is in the configuration.
void read_frame_rate(const std::filesystem::path& path, GroundTruth& truth) {
  try {
    const YAML::Node rate = YAML::LoadFile(path.string())["device_config"]["framerate"];
    if (rate) truth.fps = rate.as<double>();
  } catch (const YAML::Exception& error) {
    throw Error("cannot read device_config.framerate in " + path.string() + ": " + error.what());
  }
  if (!(truth.fps > 0.0 && truth.fps <= kMaxFps))
    throw Error(path.string() + ": device_config.framerate is not a rate in frames per second");
}

std::vector<Eigen::Vector3d> read_points(const std::filesystem::path& path) {
  const NpyArray array = read_npy(path);
  if (array.shape.size() != 2 || array.shape[1] != 3 || array.shape[0] == 0)
    throw Error(path.string() + ": expected an array of shape N x 3, N at least 1");
  const std::vector<double> values = array.to_doubles();
  std::vector<Eigen::Vector3d> points(array.shape[0]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = kMillimetersPerMeter * Eigen::Map<const Eigen::Vector3d>(values.data() + 3 * i);
    if (!points[i].allFinite())
      throw Error(path.string() + ": point " + std::to_string(i) + " is not finite");
  }
  return points;
}

}  // namespace

std::filesystem::path truth_file(const std::filesystem::path& folder) {
  const auto older = folder / "true_transforms.npy", file = folder / "true_start_T_currs.npy";
  return std::filesystem::exists(older) && !std::filesystem::exists(file) ? older : file;
}

GroundTruth read_ground_truth(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw Error("there is no folder " + folder.string() + ": --truth expects a data folder");
  GroundTruth truth;
  truth.start_T_currs = read_poses(truth_file(folder));
  if (const auto config = folder / "config.yaml"; std::filesystem::exists(config))
    read_frame_rate(config, truth);
  if (const auto meta = folder / "meta.json"; std::filesystem::exists(meta)) read_meta(meta, truth);
  if (const auto mesh = folder / "gt_mesh.ply"; std::filesystem::exists(mesh)) truth.mesh_path = mesh;
  if (const auto touched = folder / "touched.npy"; std::filesystem::exists(touched))
    truth.touched_mm = read_points(touched);
  return truth;
}

}  // namespace gelslam
