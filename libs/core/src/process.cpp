#include "gelslam/core/process.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

namespace gelslam {

double resident_memory_mb() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0.0;
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

void lower_thread_priority() {
  constexpr int kSteps = 10,
                kLowest = 19;  // ten steps: about a tenth of the processor time beside the caller
  // On Linux a nice value belongs to a thread, and 0 is the calling one.
  errno = 0;
  const int now = ::getpriority(PRIO_PROCESS, 0);  // -1 is a value, too
  if (errno == 0) ::setpriority(PRIO_PROCESS, 0, std::min(now + kSteps, kLowest));
}

}  // namespace gelslam
