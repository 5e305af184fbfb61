#include <gtest/gtest.h>
#include <unistd.h>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

using test::message_of;

std::string second_locker(const std::filesystem::path& folder) {
  return message_of([&] { FolderLock{folder}; });
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

TEST(FolderLock, NamesWhatIsNoFolder) {
  const test::TemporaryFolder folder;
  test::write_bytes(folder / "file", "");
  for (const char* name : {"file", "none"})
    EXPECT_NE(second_locker(folder / name).find(name), std::string::npos);
}

}  // namespace
}  // namespace gelslam
