#include <algorithm>
#include <set>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "protocols/trials.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 3;  // Levels of folders: data set, object, trial.

void collect(const fs::path& folder, int depth, std::vector<fs::path>& trials) {
  if (fs::is_regular_file(truth_file(folder)))
    trials.push_back(folder);
  else if (depth < kDeepest)
    for (const fs::path& one : subfolders(folder)) collect(one, depth + 1, trials);
}

std::string object_of(const std::string& name) {
  const std::size_t end = name.find_last_not_of("0123456789");
  return end == std::string::npos ? name : name.substr(0, end + 1);
}

}  // namespace

std::vector<fs::path> subfolders(const fs::path& folder) {
  std::vector<fs::path> folders;
  if (!fs::is_directory(folder)) return folders;
  for (const auto& entry : fs::directory_iterator(folder, fs::directory_options::skip_permission_denied))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::ranges::sort(folders, natural_less, [](const fs::path& path) { return path.filename().string(); });
  return folders;
}

std::vector<BenchmarkTrial> find_trials(const std::vector<fs::path>& folders) {
  std::vector<BenchmarkTrial> trials;
  std::set<fs::path> seen;
  for (const fs::path& folder : folders) {
    if (!fs::is_directory(folder)) throw Error(folder.string() + ": there is no such folder");
    std::vector<fs::path> found;
    collect(folder, 0, found);
    if (found.empty())
      throw Error(
          folder.string() +
          ": neither it nor its sub-folders hold a true_start_T_currs.npy, without which there is nothing to "
          "compare with");
    for (const fs::path& path : found) {
      const fs::path canonical = fs::canonical(path);
      if (!seen.insert(canonical).second) continue;
      const std::string name = canonical.filename().string();
      trials.push_back({path, name, object_of(name)});
    }
  }
  return trials;
}

}  // namespace gelslam
