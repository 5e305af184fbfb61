#include <algorithm>
#include <set>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "protocols/trials.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 3;  // data set, object, trial

bool is_trial(const fs::path& folder) { return fs::is_regular_file(truth_file(folder)); }

void collect(const fs::path& folder, int depth, std::vector<fs::path>& trials) {
  if (is_trial(folder)) {
    trials.push_back(folder);
    return;
  }
  if (depth == kDeepest) return;
  std::vector<fs::path> inside;
  for (const auto& entry : fs::directory_iterator(folder, fs::directory_options::skip_permission_denied))
    if (entry.is_directory()) inside.push_back(entry.path());
  std::sort(inside.begin(), inside.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  for (const fs::path& one : inside) collect(one, depth + 1, trials);
}

std::string object_of(const std::string& name) {
  const std::size_t end = name.find_last_not_of("0123456789");
  return end == std::string::npos ? name : name.substr(0, end + 1);
}

}  // namespace

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
