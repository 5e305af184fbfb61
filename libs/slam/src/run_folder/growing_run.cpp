#include "run_folder/growing_run.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

RunFolderOptions options_for(const NewRun& wanted) {
  return {.overwrite = wanted.overwrite, .inputs = {wanted.input, wanted.continued_run}};
}

}  // namespace

void GrowingRun::check(const NewRun& wanted) { check_run_folder(wanted.folder, options_for(wanted)); }

GrowingRun::GrowingRun(fs::path folder, fs::path log, ScanPart part, bool continues,
                       std::shared_ptr<const FolderLock> lock)
    : folder_(std::move(folder)),
      log_(std::move(log)),
      part_(std::move(part)),
      continues_(continues),
      lock_(std::move(lock)) {}

std::shared_ptr<GrowingRun> GrowingRun::begin(const NewRun& wanted, const Config& config,
                                              std::int64_t first_frame) {
  RunFolder run(wanted.folder, options_for(wanted));
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
  auto lock = std::make_shared<const FolderLock>(run.commit());
  return std::shared_ptr<GrowingRun>(new GrowingRun(path, log, std::move(part), continues, std::move(lock)));
}

std::shared_ptr<GrowingRun> GrowingRun::resume(const fs::path& folder, const ContinuedScan& scan,
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
  return std::shared_ptr<GrowingRun>(new GrowingRun(path, log, std::move(part), true, scan.lock));
}

std::string GrowingRun::write_session(SessionQueue& measured) const {
  const QueueCloser end{measured};
  try {
    Store store(folder_);
    if (continues_) store.add(part_);
    while (const auto work = measured.pop()) (*work)(store);
    store.flush();
    return "";
  } catch (const std::exception& error) {  // whatever it is, the scan goes on
    return error.what();
  }
}

void GrowingRun::save(const Run& run, bool session_is_whole) const {
  if (!lock_->is_of(folder_))
    throw Error(folder_.string() + ": was moved or removed during the scan; fuse it where it is now");
  replace_results(
      folder_,
      [&](const fs::path& saving) {
        write_results(saving, run);
        if (!session_is_whole) write_store(saving, run.map);
      },
      &run.map);
}

}  // namespace gelslam::slam::detail
