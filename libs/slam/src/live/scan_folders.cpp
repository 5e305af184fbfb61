#include "live/scan_folders.hpp"

namespace gelslam::slam::detail {

namespace fs = std::filesystem;

ScanFolders::ScanFolders(const LiveOptions& options) : options_(options) {
  if (options.run_folder.empty()) return;
  if (!options.continued) {
    runs_.push_back(
        std::make_shared<LiveRun>(options.run_folder, options.overwrite, options.log, options.config));
    return;
  }
  runs_.push_back(LiveRun::resume(options.run_folder, options.config, options.continued->lock));
  keep_newest();
}

std::shared_ptr<LiveRun> ScanFolders::newest() const {
  const std::lock_guard lock(mutex_);
  return runs_.empty() ? nullptr : runs_.back();
}

std::shared_ptr<LiveRun> ScanFolders::of_scan(int scan) const {
  const std::lock_guard lock(mutex_);
  return runs_.empty() ? nullptr : runs_.at(static_cast<std::size_t>(scan));
}

fs::path ScanFolders::next() const {
  const std::lock_guard lock(mutex_);
  return next_;
}

std::uintmax_t ScanFolders::record_bytes() const {
  const std::shared_ptr<LiveRun> run = newest();
  std::error_code code;
  const std::uintmax_t bytes = run ? fs::file_size(run->session() / "scan.jsonl", code) : 0;
  return code ? 0 : bytes;  // not begun
}

void ScanFolders::keep_newest() {
  const std::lock_guard lock(mutex_);
  if (!runs_.empty()) next_ = next_run_folder(runs_.front()->folder());
}

void ScanFolders::begin_scan() {
  const std::lock_guard lock(mutex_);
  if (!runs_.empty())
    runs_.push_back(next_.empty() ? runs_.back()
                                  : std::make_shared<LiveRun>(next_, false, options_.log, options_.config));
  next_.clear();
}

}  // namespace gelslam::slam::detail
