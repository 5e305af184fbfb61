#include "gelslam/core/process.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

namespace gelslam {

double resident_memory_mb() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0.0;
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

void lower_thread_priority() {
  constexpr int kNice = 10;
  // On Linux a nice value belongs to a thread, and 0 is the calling one.
  ::setpriority(PRIO_PROCESS, 0, kNice);
}

}  // namespace gelslam
