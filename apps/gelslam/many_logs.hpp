#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace gelslam {

/// `gelslam reconstruct` of several logs.
struct ManyLogs {
  std::vector<std::string> logs;
  std::filesystem::path folder;      ///< of the run folders, which are called like the logs
  std::vector<std::string> options;  ///< of each reconstruction, as on the command line
  int jobs = 0;                      ///< at a time; 0: as many as cores and memory allow
  bool overwrite = false, quiet = false;
};

/// The run folder's name: the log's without its ending; of gelsight.avi and log.mkv that of their folder.
std::string run_name(const std::filesystem::path& log);

/// Reconstructs each log in a process of its own, but for those that are finished, and prints a table of all.
/// A log that fails does not stop the others. Returns the exit code: the worst of all logs. Throws Error when
/// two logs would go to one folder, or `folder` cannot hold runs.
int reconstruct_each(const ManyLogs& request);

}  // namespace gelslam
