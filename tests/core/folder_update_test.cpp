#include "gelslam/core/folder_update.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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
    for (const char* file : {"config.yaml", "mesh.ply", "session/1.surface", "session/2.surface"})
      write_bytes(folder / file, "old");
  }
  std::string contents() const {
    std::string text;
    for (const char* file : {"config.yaml", "mesh.ply", "session/1.surface", "session/2.surface"})
      text += read_bytes(folder / file) + " ";
    return text;
  }
  void write(const FolderUpdate& update) const {
    fs::create_directory(update.path() / "session");
    for (const char* file : {"config.yaml", "mesh.ply", "session/2.surface"})
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
TEST_F(FolderUpdateOfARun, IsFinishedByTheNextWriterAndRefusedToReaders) {
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
      EXPECT_THAT(message_of<Error>([&] { check_is_run(folder.path()); }),
                  HasSubstr("its last save is not complete; gelslam fuse"));
      EXPECT_FALSE(fs::exists(folder / "mesh.ply")) << "those who read change nothing";
      finish_update(folder.path());
      check_is_run(folder.path());
    } else {
      const FolderUpdate next(folder.path());
    }
    EXPECT_EQ(contents(), "new new old new ");
    EXPECT_THAT(folder.names(), ElementsAre("config.yaml", "mesh.ply", "session"));
  }
}

/// A run that came from somebody else: nothing outside of it is moved, replaced, or made.
TEST_F(FolderUpdateOfARun, MovesNothingOutOfTheFolderAndOnlyWhatASaveWrites) {
  const TemporaryFolder outside;
  write_bytes(outside / "mesh.ply", "precious");
  const auto expect_refused = [&](const std::string& why) {
    EXPECT_THAT(message_of<Error>([&] { finish_update(folder.path()); }), HasSubstr(why));
    EXPECT_THAT(message_of<Error>([&] { FolderUpdate update(folder.path()); }), HasSubstr(why));
    EXPECT_THAT(outside.names(), ElementsAre("mesh.ply"));
    EXPECT_EQ(read_bytes(outside / "mesh.ply"), "precious");
    fs::remove_all(folder / "saved.tmp");
  };
  fs::create_directory_symlink(outside.path(), folder / "saved.tmp");
  expect_refused("cannot be written");
  fs::create_directory(folder / "saved.tmp");
  fs::create_symlink(outside / "mesh.ply", folder / "saved.tmp/mesh.ply");
  expect_refused("saved.tmp/mesh.ply: was not put there by a save");
  fs::create_directory(folder / "saved.tmp");
  write_bytes(folder / "saved.tmp/log.mkv", "no pictures");
  expect_refused("saved.tmp/log.mkv: was not put there by a save");
  fs::create_directories(folder / "saved.tmp/session");
  write_bytes(folder / "saved.tmp/session/1.surface", "new");
  fs::remove_all(folder / "session");
  fs::create_directory_symlink(outside.path(), folder / "session");
  expect_refused("session/1.surface: cannot be written");
}

TEST(CheckIsRun, RefusesLinksAndPipesInThePlaceOfFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"mesh.ply", "report.json", "log-2.mkv", "session/7.surface", "session/whatever"})
    for (const bool is_pipe : {false, true}) {
      fs::remove_all(folder / "RUN");
      fs::create_directories(folder / "RUN/session");
      write_bytes(folder / "RUN/trajectory.tum", "");
      fs::create_symlink("/etc/hostname", folder / "RUN/a person's own link");
      EXPECT_EQ(message_of<Error>([&] { check_is_run(folder / "RUN"); }), "nothing was thrown");
      if (is_pipe)
        ASSERT_EQ(::mkfifo((folder / "RUN" / name).c_str(), 0600), 0);
      else
        fs::create_symlink("/etc/hostname", folder / "RUN" / name);
      EXPECT_THAT(message_of<Error>([&] { check_is_run(folder / "RUN"); }),
                  HasSubstr(std::string(name) + ": is a link, pipe or device"));
    }
  fs::rename(folder / "RUN/session", folder / "elsewhere");
  fs::create_directory_symlink(folder / "elsewhere", folder / "RUN/session");
  EXPECT_THAT(message_of<Error>([&] { check_is_run(folder / "RUN"); }), HasSubstr("session: is a link"));
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
