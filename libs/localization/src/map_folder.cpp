#include "gelslam/localization/map_folder.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/slam/session.hpp"

namespace gelslam {

std::vector<PosedSurface> read_map(const std::filesystem::path& folder) {
  for (const std::filesystem::path& session : {folder / "session", folder})
    if (std::filesystem::exists(session / "session.json")) return load_session(session).patches;
  throw Error(folder.string() + ": no map; give a run folder, its session, or a folder made by gelslam map");
}

}  // namespace gelslam
