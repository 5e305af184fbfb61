#include "run_folder/session_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr double kMaxInformation = 1e12;  // sigmas of a millionth of a radian and of a millimeter
constexpr std::string_view kChecksumMember = ",\"crc32\":";

Json numbers(const Eigen::Vector3d& mm) { return {mm.x(), mm.y(), mm.z()}; }

/// The upper half, row by row.
Json numbers(const Matrix6d& symmetric) {
  Json values = Json::array();
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) values.push_back(symmetric(r, c));
  return values;
}

Matrix6d matrix_from(const Json& json) {
  if (json.size() != 21) throw Error("the numbers of a matrix are incomplete");
  Matrix6d matrix;
  std::size_t k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) matrix(r, c) = matrix(c, r) = number_from(json[k++], kMaxInformation);
  return matrix;
}

Eigen::Vector3d point_from(const Json& json) {
  if (json.size() != 3) throw Error("an edge's numbers are incomplete");
  Eigen::Vector3d mm;
  for (int c = 0; c < 3; ++c) mm[c] = number_from(json.at(static_cast<std::size_t>(c)), kMaxDistanceMm);
  return mm;
}

EdgeKind kind_from(const Json& json) {
  const auto word = json.get<std::string>();
  if (word != "loop" && word != "odometry") throw Error("unknown kind of an edge");
  return word == "loop" ? EdgeKind::loop : EdgeKind::odometry;
}

}  // namespace

std::string with_checksum(const Json& object) {
  std::string line = object.dump(-1, ' ', false, Json::error_handler_t::replace);
  line.pop_back();  // the brace
  const std::uint32_t sum = crc32_of(line);
  return fmt::format("{}{}{}}}\n", line, kChecksumMember, sum);
}

std::optional<Json> without_damage(std::string_view line) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  const std::size_t at = line.rfind(kChecksumMember);
  if (at == std::string_view::npos || !line.ends_with('}')) return std::nullopt;
  const std::size_t digits = at + kChecksumMember.size();
  if (line.substr(digits, line.size() - 1 - digits) != std::to_string(crc32_of(line.substr(0, at))))
    return std::nullopt;
  Json object = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) return std::nullopt;
  return object;
}

void check_session_version(int version) {
  if (version > kSessionVersion)
    throw Error(
        fmt::format("written by a newer version of the program (session version {}, this one reads "
                    "up to {}); update gelslam",
                    version, kSessionVersion));
  if (version < kSessionVersion) throw Error("impossible version");
}

double number_from(const Json& json, double most) {
  const auto value = json.get<double>();  // null, as infinity is written, is not a number
  if (!(std::abs(value) <= most)) throw Error("holds an impossible number");
  return value;
}

std::int64_t integer_from(const Json& json, std::int64_t min, std::int64_t max) {
  const bool too_large = json.is_number_unsigned() &&
                         json.get<std::uint64_t>() > std::uint64_t{std::numeric_limits<std::int64_t>::max()};
  const bool possible = json.is_number_integer() && !too_large && json.get<std::int64_t>() >= min &&
                        json.get<std::int64_t>() <= max;
  if (!possible) throw Error("holds an impossible number");
  return json.get<std::int64_t>();
}

Json numbers(const Pose& pose) {
  Json values = Json::array();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) values.push_back(pose.matrix()(r, c));
  return values;
}

Pose pose_from(const Json& json) {
  if (!json.is_array() || json.size() != 12) throw Error("a pose needs 12 numbers");
  Pose pose = Pose::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      pose(r, c) = number_from(json[static_cast<std::size_t>(r * 4 + c)], kMaxDistanceMm);
  const bool rotation = pose.linear().isUnitary(1e-6) && std::abs(pose.linear().determinant() - 1.0) < 1e-6;
  if (!rotation) throw Error("a pose is no rigid motion");
  return pose;
}

Json json_of(const PoseGraphEdge& edge) {
  return {{"from", edge.from},
          {"to", edge.to},
          {"kind", edge.kind == EdgeKind::loop ? "loop" : "odometry"},
          {"from_T_to_mm", numbers(edge.from_T_to)},
          {"information", numbers(edge.information)},
          {"shared_center_mm", numbers(edge.shared_center_mm)},
          {"tentative", edge.tentative}};
}

PoseGraphEdge edge_from(const Json& json) {
  PoseGraphEdge edge;
  edge.to = integer_from(json.at("to"), 1, kMaxKeyframeId);
  edge.from = integer_from(json.at("from"), 0, edge.to - 1);
  edge.kind = kind_from(json.at("kind"));
  edge.from_T_to = pose_from(json.at("from_T_to_mm"));
  edge.information = matrix_from(json.at("information"));
  edge.shared_center_mm = point_from(json.at("shared_center_mm"));
  edge.tentative = json.at("tentative").get<bool>();
  return edge;
}

std::filesystem::path surface_file(const std::filesystem::path& session, int keyframe) {
  return session / (std::to_string(keyframe) + ".surface");
}

}  // namespace gelslam::slam::detail
