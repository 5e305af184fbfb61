#include "gelslam/core/folder_update.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

class FolderUpdateOfARun : public testing::Test {
 protected:
  FolderUpdateOfARun() {
    fs::create_directories(folder / "session");
    for (const char* file : {"config.yaml", "mesh.ply", "session/1", "session/2"})
      write_bytes(folder / file, "old");
  }
  std::string contents() const {
    std::string text;
    for (const char* file : {"config.yaml", "mesh.ply", "session/1", "session/2"})
      text += read_bytes(folder / file) + " ";
    return text;
  }
  void write(const FolderUpdate& update) const {
    fs::create_directory(update.path() / "session");
    for (const char* file : {"config.yaml", "mesh.ply", "session/2"})
      write_bytes(update.path() / file, "new");
  }
  TemporaryFolder folder;
};

TEST_F(FolderUpdateOfARun, IsWholeOrNotAtAll) {
  {
    const FolderUpdate update(folder.path());
    write(update);
  }
  EXPECT_EQ(contents(), "old old old old ");
  FolderUpdate update(folder.path());
  write(update);
  update.commit();
  EXPECT_EQ(contents(), "new new old new ");
  EXPECT_THAT(folder.names(), ElementsAre("config.yaml", "mesh.ply", "session"));
}

/// What is in the way of one file stops the replacement between two of them, as a kill would.
TEST_F(FolderUpdateOfARun, IsFinishedByTheNextReaderOrWriter) {
  for (const bool by_reader : {true, false}) {
    write_bytes(folder / "config.yaml", "old");
    fs::remove(folder / "mesh.ply");
    fs::create_directories(folder / "mesh.ply/in the way");
    {
      FolderUpdate update(folder.path());
      write(update);
      EXPECT_THAT(message_of<Error>([&] { update.commit(); }), HasSubstr("mesh.ply: cannot be written"));
    }
    fs::remove_all(folder / "mesh.ply");
    EXPECT_EQ(read_bytes(folder / "config.yaml"), "new") << "some are in their places";
    if (by_reader) {
      {
        const FolderLock busy(folder.path());
        finish_update(folder.path());
        EXPECT_FALSE(fs::exists(folder / "mesh.ply")) << "its writer is at work";
      }
      check_is_run(folder.path());
    } else {
      const FolderUpdate next(folder.path());
    }
    EXPECT_EQ(contents(), "new new old new ");
    EXPECT_THAT(folder.names(), ElementsAre("config.yaml", "mesh.ply", "session"));
  }
}

TEST(CheckIsRun, SaysWhatIsMissingAndWhatToDo) {
  const TemporaryFolder folder;
  const auto said = [&](RunNeeds needs) {
    return message_of<Error>([&] { check_is_run(folder / "RUN", needs); });
  };
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("RUN: no such run folder"));
  fs::create_directories(folder / "RUN/session");
  EXPECT_THAT(said(RunNeeds::record), HasSubstr("RUN: is no run folder"));
  write_bytes(folder / "RUN/session/scan.jsonl", "");
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("the scan was not finished; gelslam fuse makes its map"));
  EXPECT_EQ(said(RunNeeds::record), "nothing was thrown");
  write_bytes(folder / "RUN/session/session.json", "{}");
  EXPECT_EQ(said(RunNeeds::map), "nothing was thrown");
}

}  // namespace
}  // namespace gelslam
