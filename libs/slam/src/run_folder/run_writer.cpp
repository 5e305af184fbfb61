#include "run_folder/run_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>

#include "gelslam/backend/g2o.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;

std::map<int, Pose> map_poses(const SlamMap& map) {
  std::map<int, Pose> poses;
  for (const PosedSurface& patch : posed_surfaces(snapshot_of(map)))
    poses.emplace(patch.id, patch.map_T_keyframe);
  return poses;
}

std::string keyframe_trajectory(const SlamMap& map) {
  const std::vector<double> stamps_s = map.stamps_s();
  std::map<std::int64_t, double> time_s;
  for (std::size_t i = 0; i < stamps_s.size(); ++i) time_s[map.frames[i].frame] = stamps_s[i];
  std::string text;
  for (const auto& [id, pose] : map_poses(map))
    text += tum_line(time_s.at(map.keyframes[static_cast<std::size_t>(id)]->frame), pose);
  return text;
}

/// Returns the edges between keyframes of the map: either the outliers or all others.
std::vector<PoseGraphEdge> map_edges(const SlamMap& map, bool outliers) {
  const auto in_map = [&](int id) { return map.in_map[static_cast<std::size_t>(id)]; };
  std::vector<PoseGraphEdge> edges;
  for (std::size_t i = 0; i < map.solved_edges.size(); ++i) {
    const PoseGraphEdge& edge = map.solved_edges[i];
    if (in_map(edge.from) && in_map(edge.to) && map.solution.edge_outlier[i] == outliers)
      edges.push_back(edge);
  }
  return edges;
}

void move_file(const fs::path& from, const fs::path& to) {
  std::error_code code;
  fs::rename(from, to, code);
  if (code) throw Error(to.string() + ": cannot be written: " + code.message());
}

/// Replaces a session that could not be written to. Its auxiliary files are removed first, because SQLite
/// would take its write-ahead log for that of the new session.
void replace_session(const fs::path& from, const fs::path& run) {
  std::error_code code;
  for (const char* beside : {"session.db-wal", "session.db-shm"}) fs::remove(run / beside, code);
  move_file(from, run / "session.db");
}

/// Replaces the temporary file name in a message by the final one.
std::string in_run(std::string message) {
  const std::string on_the_way = std::string(kSaving) + "/";
  const std::size_t at = message.find(on_the_way);
  return at == std::string::npos ? message : message.erase(at, on_the_way.size());
}

RunFolderOptions options_for(const NewRun& wanted) {
  return {.overwrite = wanted.overwrite, .inputs = {wanted.input, wanted.continued_run}};
}

}  // namespace

void write_run(const fs::path& folder, const Run& run) {
  write_results(folder, run);
  write_store(folder, run.map);
}

void write_results(const fs::path& folder, const Run& run) {
  const SlamMap& map = run.map;
  write_mesh(folder / "mesh.ply", run.mesh);
  const std::vector<StampedPose> trajectory = map.trajectory();
  write_file_atomically(folder / "trajectory.tum", tum_text(trajectory));
  write_covariances(folder / "covariances.npy", trajectory);
  write_file_atomically(folder / "keyframes.tum", keyframe_trajectory(map));
  write_g2o(folder / "pose_graph.g2o", map_poses(map), map_edges(map, false));
  write_g2o_edges(folder / "loop_outliers.g2o", map_edges(map, true));
  write_file_atomically(folder / "config.yaml", write_config(run.config));
  write_file_atomically(folder / "report.json", report_json(run.report));
}

void replace_results(const fs::path& run, const std::function<void(const fs::path&)>& write,
                     const SlamMap* map) {
  const fs::path saving = run / kSaving;
  check_save(run);
  std::error_code code;
  fs::remove_all(saving, code);
  if (!code) fs::create_directory(saving, code);
  if (code) throw Error(run.string() + ": cannot be written: " + code.message());
  try {
    write(saving);
  } catch (const Error& error) {
    fs::remove_all(saving, code);
    throw Error(in_run(error.what()));
  }
  const auto write_report = [&](const std::optional<RunReport>& report) {
    if (report) write_file_atomically(run / "report.json", report_json(*report));
  };
  const std::optional<RunReport> before = find_report(run);
  // Valid until the new report is written, which is the last file of a save.
  std::optional<RunReport> unfinished = before;
  if (unfinished) unfinished->saved = false;
  write_report(unfinished);
  if (fs::exists(saving / "session.db", code))
    replace_session(saving / "session.db", run);
  else if (map)
    try {
      Store(run).set_map(*map);
    } catch (const Error&) {  // Either all of the save takes effect or nothing.
      fs::remove_all(saving, code);
      write_report(before);
      throw;
    }
  for (const std::string& file : saved_entries())
    if (fs::exists(saving / file, code)) move_file(saving / file, run / file);
  sync_folder(run);
  fs::remove_all(saving, code);
}

void slam::detail::check_run(const NewRun& wanted) { check_run_folder(wanted.folder, options_for(wanted)); }

GrowingRun slam::detail::begin_run(const NewRun& wanted, const Config& config, std::int64_t first_frame) {
  auto folder = std::make_shared<RunFolder>(wanted.folder, options_for(wanted));
  RunFolder& run = *folder;
  const fs::path path = run.final_path(), log = path / "log.mkv";
  ScanPart part = part_of(config, wanted.records ? log : wanted.input);
  part.first_frame = first_frame;
  const bool continues = !wanted.continued_run.empty();
  continues ? copy_store(wanted.continued_run, run.path()) : begin_store(run.path(), part);
  write_file_atomically(run.path() / "config.yaml", write_config(config));
  RunReport nothing_saved;
  nothing_saved.partial = true;
  nothing_saved.saved = false;
  write_file_atomically(run.path() / "report.json", report_json(nothing_saved));
  if (run.replaces() && !wanted.records)
    return {run.path(), log, std::move(part), continues, nullptr, folder};
  return {path, log, std::move(part), continues, std::make_shared<const FolderLock>(run.commit()), nullptr};
}

GrowingRun slam::detail::resume_run(const fs::path& folder, const ContinuedScan& scan, const fs::path& input,
                                    bool records, const Config& config) {
  std::error_code code;
  const fs::path path = fs::canonical(folder, code);
  if (code) throw Error(folder.string() + ": cannot be reached: " + code.message());
  if (::access((path / "session.db").c_str(), W_OK) != 0 || ::access(path.c_str(), W_OK) != 0)
    throw Error(folder.string() + ": cannot be continued: " + std::strerror(errno));
  fs::path log = path / "log.mkv";
  for (int part = 2; fs::exists(log, code); ++part) log = path / ("log-" + std::to_string(part) + ".mkv");
  ScanPart part = part_of(config, records ? log : input);
  part.first_frame = scan.record.next_frame();
  return {path, std::move(log), std::move(part), true, scan.lock, nullptr};
}

std::string GrowingRun::write_session(SessionQueue& measured,
                                      const std::function<void(const std::string&)>& say) const {
  const fs::path path = folder / "session.db";
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::string problem;
  try {
    Store store(folder);
    const auto attempt = [&](const std::function<void(Store&)>& work) {
      try {
        work(store);
        problem = leads_to(path, file) ? "" : path.string() + ": was removed; it is written again at the end";
      } catch (const std::exception& error) {  // The scan must go on, whatever the exception is.
        problem = error.what();
      }
      if (!problem.empty()) say(problem);
    };
    if (continues) attempt([&](Store& session) { session.add(part); });
    while (const auto work = measured.pop()) attempt(*work);
    attempt(&Store::flush);
  } catch (const Error& error) {
    say(problem = error.what());
  }
  return problem;
}

void GrowingRun::save(const Run& run, const std::string& session_problem) const {
  if (lock && !lock->is_of(folder))
    throw Error(folder.string() + ": was moved or removed during the scan; fuse it where it is now");
  if (replacement && run.report.partial) throw Error("stopped early; the run that is there stays as it was");
  const auto write = [&](const fs::path& saving) {
    write_results(saving, run);
    if (!session_problem.empty()) write_store(saving, run.map);
  };
  try {
    replace_results(folder, write, &run.map);
  } catch (const Error& error) {
    if (session_problem.empty()) throw;
    throw Error(std::string(error.what()) + "; " + session_problem);
  }
}

void GrowingRun::put_in_place() {
  if (!replacement) return;
  lock = std::make_shared<const FolderLock>(replacement->commit());
  folder = std::exchange(replacement, nullptr)->final_path();
}

}  // namespace gelslam
