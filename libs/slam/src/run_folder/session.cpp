#include "gelslam/slam/session.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "run_folder/scan_writer.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;

/// What was concluded from a ScanRecord, as session.json holds it.
struct SavedMap {
  double gradient_scale = 1.0;
  std::map<int, Pose> map_T_keyframe;  // of the map's keyframes
  std::vector<MapSnapshot::Edge> edges;
  std::uintmax_t scan_bytes = 0;  // so much of scan.jsonl it was concluded from
  std::uint32_t scan_crc32 = 0;   // of the last 64 bytes of that; 0: not known
};

constexpr std::string_view kNotASession = "damaged, or not a session of gelslam";

/// Names a scan, also while it grows: CRC-32 of the end of its first `bytes`, which holds the checksum of a
/// line. 0: it has less.
std::uint32_t crc32_at(const fs::path& scan, std::uintmax_t bytes) {
  std::string end(std::min<std::uintmax_t>(bytes, 64), 0);
  std::ifstream file(scan, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(bytes - end.size()));
  return file.read(end.data(), std::ssize(end)) ? crc32_of(end) : 0;
}

Json json_of(const SlamMap& map, const fs::path& scan, std::uintmax_t scan_bytes) {
  Json json = {{"version", kSessionVersion},
               {"scan_bytes", scan_bytes},
               {"scan_crc32", crc32_at(scan, scan_bytes)},
               {"anchor_frame", map.anchor_frame},
               {"gradient_scale", map.gradient_scale.mean()},
               {"keyframes", Json::array()},
               {"edges", Json::array()}};
  for (const auto& [id, component] : map.solution.component_of_node) {
    const Keyframe& keyframe = *map.keyframes[static_cast<std::size_t>(id)];
    const bool in_map = map.in_map[static_cast<std::size_t>(id)];
    const Pose pose = in_map ? map.anchor_T_keyframe(id) : map.solution.component_T_node.at(id);
    json["keyframes"].push_back({{"id", id},
                                 {"frame", keyframe.frame},
                                 {"trial", keyframe.trial},
                                 {"component", component},
                                 {"in_map", in_map},
                                 {in_map ? "map_T_keyframe_mm" : "component_T_keyframe_mm", numbers(pose)}});
  }
  for (std::size_t i = 0; i < map.edges.size(); ++i) {
    json["edges"].push_back(slam::detail::json_of(map.edges[i]));
    json["edges"].back()["outlier"] = static_cast<bool>(map.solution.edge_outlier[i]);
  }
  return json;
}

std::string read_text(const fs::path& file) {
  if (!fs::exists(file) && fs::exists(file.parent_path() / "scan.jsonl"))
    throw Error(file.string() + ": is not there: " + kUnfinishedScan);
  return read_file(file);
}

SavedMap map_from(const Json& json) {
  SavedMap map;
  map.gradient_scale = json.at("gradient_scale").get<double>();
  if (!(map.gradient_scale > 0.1 && map.gradient_scale < 10)) throw Error("impossible gradient scale");
  map.scan_bytes = json.at("scan_bytes").get<std::uintmax_t>();
  map.scan_crc32 = json.value("scan_crc32", std::uint32_t{0});
  for (const Json& entry : json.at("keyframes")) {
    const int id = integer_from(entry.at("id"), 0, kMaxKeyframeId);
    if (!entry.at("in_map").get<bool>()) continue;
    if (!map.map_T_keyframe.empty() && id <= map.map_T_keyframe.rbegin()->first)
      throw Error("keyframe ids do not ascend");
    map.map_T_keyframe.emplace(id, pose_from(entry.at("map_T_keyframe_mm")));
  }
  for (const Json& entry : json.at("edges")) {
    const PoseGraphEdge edge = edge_from(entry);
    map.edges.push_back({edge.from, edge.to, edge.kind, entry.at("outlier").get<bool>()});
  }
  return map;
}

/// `text` is the whole file.
SavedMap checked_map(const std::string& text) {
  const std::optional<Json> json = without_damage(text);
  if (!json) throw Error("damaged: its checksum does not match");
  return map_from(*json);
}

bool is_of_another_scan(const SavedMap& map, const fs::path& folder) {
  return map.scan_crc32 != 0 && crc32_at(folder / "scan.jsonl", map.scan_bytes) != map.scan_crc32;
}

/// "": of the whole scan.
std::string what_is_missing(const SavedMap& map, const fs::path& folder) {
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(folder / "scan.jsonl", code);
  if (code) return "";
  if (is_of_another_scan(map, folder))
    return folder.string() +
           ": session.json is the map of another scan than scan.jsonl; gelslam fuse makes the map of that";
  if (bytes <= map.scan_bytes) return "";
  return folder.string() +
         ": the scan went on after its map was saved; gelslam fuse makes the map of all of it";
}

Session patches_of(const SavedMap& map, const fs::path& folder) {
  Session session;
  if (const std::string missing = what_is_missing(map, folder); !missing.empty()) {
    session.is_current = false;
    session.warnings.push_back(missing);
    if (is_of_another_scan(map, folder)) return session;
  }
  session.gradient_scale = map.gradient_scale;
  session.edges = map.edges;
  int unreadable = 0;
  std::string why;
  for (const auto& [id, map_T_keyframe] : map.map_T_keyframe) {
    try {
      session.patches.push_back(
          {id, map_T_keyframe, StoredSurface(read_packed_surface(surface_file(folder, id)))});
    } catch (const Error& error) {
      if (unreadable++ == 0) why = error.what();
    }
  }
  if (unreadable > 0)
    session.warnings.push_back(counted(unreadable, "keyframe") + " of " + folder.string() +
                               " cannot be used: " + why);
  return session;
}

/// What is wrong is said with the name of session.json.
SavedMap read_map(const fs::path& folder) {
  check_run_files(folder);
  const fs::path file = folder / "session.json";
  const std::string text = read_text(file);
  try {
    const Json json = Json::parse(text);
    check_session_version(integer_from(json.at("version"), 0, std::numeric_limits<int>::max()));
    return checked_map(text);
  } catch (const nlohmann::json::exception&) {
    throw Error(file.string() + ": " + std::string(kNotASession));
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
}

}  // namespace

void save_session(const fs::path& folder, const SlamMap& map) {
  ScanRecord record = map.measured;
  if (record.keyframes.empty()) record.keyframes = map.keyframes;  // a map that no scan has measured
  write_scan(folder, record);
  save_map(folder, map, folder / "scan.jsonl", fs::file_size(folder / "scan.jsonl"));
}

void save_map(const fs::path& folder, const SlamMap& map, const fs::path& scan, std::uintmax_t scan_bytes) {
  write_file_atomically(folder / "session.json", with_checksum(json_of(map, scan, scan_bytes)));
}

Session load_session(const fs::path& folder) { return patches_of(read_map(folder), folder); }

}  // namespace gelslam
