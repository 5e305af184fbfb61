#include "run_folder/live_run.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

RunFolderOptions options_for(bool overwrite, const fs::path& input) {
  return {.overwrite = overwrite, .inputs = {input}};
}

}  // namespace

void LiveRun::check(const fs::path& folder, bool overwrite, const fs::path& input) {
  gelslam::check_run_folder(folder, options_for(overwrite, input));
}

LiveRun::LiveRun(fs::path folder, fs::path log, ScanPart part, std::shared_ptr<const FolderLock> lock)
    : folder_(std::move(folder)), log_(std::move(log)), part_(std::move(part)), lock_(std::move(lock)) {}

std::shared_ptr<LiveRun> LiveRun::begin(const fs::path& folder, bool overwrite, const fs::path& input,
                                        bool records, const Config& config) {
  RunFolder run(folder, options_for(overwrite, input));
  const fs::path path = run.final_path(), log = path / "log.mkv";
  ScanPart part = part_of(config, records ? log : input);
  begin_store(run.path(), part);
  write_file_atomically(run.path() / "config.yaml", write_config(config));
  RunReport nothing_saved;
  nothing_saved.partial = true;
  nothing_saved.saved = false;
  write_file_atomically(run.path() / "report.json", report_json(nothing_saved));
  auto lock = std::make_shared<const FolderLock>(run.commit());
  return std::shared_ptr<LiveRun>(new LiveRun(path, log, std::move(part), std::move(lock)));
}

std::shared_ptr<LiveRun> LiveRun::resume(const fs::path& folder, const ContinuedScan& scan,
                                         const fs::path& input, bool records, const Config& config) {
  std::error_code code;
  const fs::path path = fs::canonical(folder, code);
  if (code) throw Error(folder.string() + ": cannot be reached: " + code.message());
  if (::access((path / "session.db").c_str(), W_OK) != 0 || ::access(path.c_str(), W_OK) != 0)
    throw Error(folder.string() + ": cannot be continued: " + std::strerror(errno));
  fs::path log = path / "log.mkv";
  for (int part = 2; fs::exists(log, code); ++part) log = path / ("log-" + std::to_string(part) + ".mkv");
  ScanPart part = part_of(config, records ? log : input);
  part.first_frame = scan.record.next_frame();
  return std::shared_ptr<LiveRun>(new LiveRun(path, log, std::move(part), scan.lock));
}

void LiveRun::save(const Run& run, bool session_is_whole) {
  // Somebody may have tidied up meanwhile; what was scanned is saved all the same.
  std::error_code code;
  if (fs::create_directories(folder_, code)) lock_ = std::make_shared<const FolderLock>(folder_);
  if (code) throw Error(folder_.string() + ": cannot be written: " + code.message());
  if (!lock_->is_of(folder_)) {
    fs::path name = folder_;
    RunFolder beside(name += ".kept-" + std::to_string(::getpid()), {.overwrite = true});
    write_run(beside.path(), run);
    beside.commit();
    throw Error(folder_.string() + ": was moved during the scan, and another folder is there now; saved in " +
                beside.final_path().string());
  }
  const bool has_session = session_is_whole && fs::exists(folder_ / "session.db", code);
  replace_results(
      folder_,
      [&](const fs::path& saving) {
        write_results(saving, run);
        if (!has_session) write_store(saving, run.map);
      },
      &run.map);
}

}  // namespace gelslam::slam::detail
