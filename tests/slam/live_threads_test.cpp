// What a live session does where the system gives no more threads.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <system_error>

#include "live_fixture.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using test::Live;

/// Root may have any number of threads, so this is done as another user.
TEST_F(Live, WithoutEnoughThreadsItEndsBeforeItBegins) {
  fs::permissions(folder.path(), fs::perms::all);
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);  // it must not hang
    const rlimit few{3, 3};
    if (::setrlimit(RLIMIT_NPROC, &few) != 0 || (::getuid() == 0 && ::setuid(65534) != 0)) ::_exit(3);
    try {
      begin_live_scan(std::move(source), options);
    } catch (const std::system_error&) {
      ::_exit(0);
    }
    ::_exit(4);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "killed by " << WTERMSIG(status) << ", exit code " << WEXITSTATUS(status);
  EXPECT_FALSE(fs::exists(options.run_folder)) << "nothing is made, or replaced";
}

}  // namespace
}  // namespace gelslam
