#include <nlohmann/json.hpp>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam {
namespace {

constexpr const char* kMapMarker = "map.json";

SlamMap slam_map_of(const std::vector<PosedSurface>& patches) {
  SlamMap map;
  map.trials = map.components = 1;
  for (const PosedSurface& patch : patches) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = patch.id;
    keyframe->frame = patch.id;
    keyframe->surface = patch.surface;
    map.keyframes.push_back(std::move(keyframe));
    map.solution.component_T_node[patch.id] = patch.map_T_keyframe;
    map.solution.component_of_node[patch.id] = 0;
    map.in_map.push_back(true);
  }
  return map;
}

}  // namespace

MapSnapshot read_map(const std::filesystem::path& folder) {
  if (has_session(folder)) return load_saved_map(folder);
  throw Error(folder.string() + ": no map; give a run folder, or a folder made by gelslam map");
}

void check_pixel_pitch(const std::vector<PosedSurface>& map, double pixel_pitch_mm, const std::string& name) {
  for (const PosedSurface& patch : map)
    if (const double pitch_mm = patch.surface.facts().pixel_pitch_mm; pitch_mm != pixel_pitch_mm)
      throw Error(name + ": has pixels of " + short_number(pitch_mm) + " mm, not of " +
                  short_number(pixel_pitch_mm) + " mm as the sensor");
}

RunFolderOptions map_folder_options(const std::filesystem::path& source, bool overwrite) {
  return {.overwrite = overwrite,
          .marker_file = kMapMarker,
          .known_entries = {kMapMarker, "mesh.ply", "keyframes.tum", "trajectory.tum", "session.db"},
          .inputs = {source}};
}

void write_map(const std::filesystem::path& folder, const MeshMap& map, const Mesh& mesh,
               const std::string& source) {
  write_store(folder, slam_map_of(map.patches));
  write_mesh(folder / "mesh.ply", mesh);
  std::string trajectory;
  for (const PosedSurface& patch : map.patches) trajectory += tum_line(patch.id, patch.map_T_keyframe);
  write_file_atomically(folder / "keyframes.tum", trajectory);
  write_file_atomically(folder / "trajectory.tum", trajectory);
  nlohmann::ordered_json json;
  json["mesh"] = source;
  json["touches"] = map.patches.size();
  json["covered_share"] = map.covered_share;
  write_file_atomically(folder / kMapMarker, json.dump(1) + "\n");
}

}  // namespace gelslam
