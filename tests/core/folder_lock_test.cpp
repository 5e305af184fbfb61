#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

using test::message_of;

std::string second_locker(const std::filesystem::path& folder) {
  return message_of<Error>([&] { FolderLock{folder}; });
}

TEST(FolderLock, KeepsASecondOneOutUntilTheFirstIsGone) {
  const test::TemporaryFolder folder;
  {
    FolderLock first(folder.path());
    const FolderLock moved = std::move(first);
    EXPECT_FALSE(first.holds());
    EXPECT_TRUE(moved.holds());
    EXPECT_EQ(second_locker(folder.path()),
              "another program (core_test, process " + std::to_string(::getpid()) + ") is writing to '" +
                  folder.path().string() + "': end it first, or name another folder");
  }
  EXPECT_EQ(second_locker(folder.path()), "nothing was thrown");
  EXPECT_TRUE(folder.names().empty());
}

TEST(FolderLock, EndsWithAProgramThatIsKilled) {
  const test::TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t other = ::fork();
  if (other == 0) {
    const FolderLock lock(folder.path());
    if (::write(ready[1], "x", 1) == 1) ::pause();
    ::_exit(1);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_NE(second_locker(folder.path()), "nothing was thrown");
  ::kill(other, SIGKILL);
  ::waitpid(other, nullptr, 0);
  EXPECT_EQ(second_locker(folder.path()), "nothing was thrown");
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST(FolderLock, NamesWhatIsNoFolder) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "");
  for (const char* name : {"file", "none"})
    EXPECT_NE(second_locker(folder / name).find(name), std::string::npos);
}

}  // namespace
}  // namespace gelslam
