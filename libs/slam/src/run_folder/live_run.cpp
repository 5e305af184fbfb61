#include "run_folder/live_run.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/folder_update.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/session.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

RunFolderOptions options_for(bool overwrite, const fs::path& input) {
  return {.overwrite = overwrite, .inputs = {input}};
}

/// Of a message that names a file on its way: with the name that the file was to have.
std::string in_run(std::string message) {
  const std::string on_the_way = "saving.tmp/";
  const std::size_t at = message.find(on_the_way);
  return at == std::string::npos ? message : message.erase(at, on_the_way.size());
}

}  // namespace

void LiveRun::check(const fs::path& folder, bool overwrite, const fs::path& input) {
  gelslam::check_run_folder(folder, options_for(overwrite, input));
}

LiveRun::LiveRun(fs::path folder, fs::path log, std::shared_ptr<const FolderLock> lock)
    : folder_(std::move(folder)), log_(std::move(log)), lock_(std::move(lock)) {}

std::shared_ptr<LiveRun> LiveRun::begin(const fs::path& folder, bool overwrite, const fs::path& input,
                                        const Config& config) {
  RunFolder run(folder, options_for(overwrite, input));
  write_file_atomically(run.path() / "config.yaml", write_config(config));
  RunReport nothing_saved;
  nothing_saved.partial = true;
  nothing_saved.saved = false;
  write_file_atomically(run.path() / "report.json", report_json(nothing_saved));
  auto lock = std::make_shared<const FolderLock>(run.commit());
  const fs::path& path = run.final_path();
  return std::shared_ptr<LiveRun>(new LiveRun(path, path / "log.mkv", std::move(lock)));
}

std::shared_ptr<LiveRun> LiveRun::resume(const fs::path& folder, std::shared_ptr<const FolderLock> lock) {
  std::error_code code;
  const fs::path path = fs::canonical(folder, code);
  if (code) throw Error(folder.string() + ": cannot be reached: " + code.message());
  if (::access((path / "session" / "scan.jsonl").c_str(), W_OK) != 0 || ::access(path.c_str(), W_OK) != 0)
    throw Error(folder.string() + ": cannot be continued: " + std::strerror(errno));
  fs::path log = path / "log.mkv";
  for (int part = 2; fs::exists(log, code); ++part) log = path / ("log-" + std::to_string(part) + ".mkv");
  return std::shared_ptr<LiveRun>(new LiveRun(path, log, std::move(lock)));
}

std::uintmax_t LiveRun::record_bytes() const {
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(session() / "scan.jsonl", code);
  return code ? 0 : bytes;  // not begun
}

void LiveRun::save(const Run& run, std::optional<std::uintmax_t> scan_bytes) {
  try {
    replace_entries(run, scan_bytes);
  } catch (const fs::filesystem_error& error) {
    throw Error(error.path1().string() + ": cannot be written: " + error.code().message());
  } catch (const Error& error) {
    throw Error(in_run(error.what()));
  }
}

void LiveRun::replace_entries(const Run& run, std::optional<std::uintmax_t> scan_bytes) {
  // Somebody may have tidied up meanwhile; what was scanned is saved all the same.
  if (fs::create_directories(folder_)) lock_ = std::make_shared<const FolderLock>(folder_);
  if (!lock_->is_of(folder_)) {
    fs::path name = folder_;
    RunFolder beside(name += ".kept-" + std::to_string(::getpid()), {.overwrite = true});
    write_run(beside.path(), run);
    beside.commit();
    throw Error(folder_.string() + ": was moved during the scan, and another folder is there now; saved in " +
                beside.final_path().string());
  }
  FolderUpdate update(folder_);
  write_results(update.path(), run);
  // The record was written while the scan went on, unless that has failed.
  const bool record_is_whole = scan_bytes && fs::exists(session() / "scan.jsonl");
  if (record_is_whole) {
    fs::create_directory(update.path() / "session");
    save_map(update.path() / "session", run.map, session() / "scan.jsonl", *scan_bytes);
  } else {
    save_session(update.path() / "session", run.map);
  }
  update.commit();
}

}  // namespace gelslam::slam::detail
