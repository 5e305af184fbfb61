#include "gelslam/core/files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../support/file_size_limit.hpp"
#include "../support/killed_process.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/run_folder.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(WriteFileAtomically, ReplacesAndLeavesNothingElse) {
  TemporaryFolder folder;
  const std::string bytes("a\0b\n", 4);
  write_file_atomically(folder / "f", "old and longer");
  write_file_atomically(folder / "f", bytes);
  EXPECT_EQ(read_bytes(folder / "f"), bytes);
  EXPECT_THAT(folder.names(), ElementsAre("f"));
  const mode_t mask = ::umask(0);
  ::umask(mask);
  struct stat status {};
  ASSERT_EQ(::stat((folder / "f").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0666 & ~mask) << "as any other program would create it";
}

TEST(WriteFileAtomically, FailedWriteKeepsTheOldFile) {
  TemporaryFolder folder;
  write_file_atomically(folder / "f", "old");
  {
    const FileSizeLimit limit(1000);
    EXPECT_THAT(message_of([&] { write_file_atomically(folder / "f", std::string(5000, 'x')); }),
                HasSubstr((folder / "f").string() + ": cannot be written"));
  }
  EXPECT_EQ(read_bytes(folder / "f"), "old");
  EXPECT_THAT(folder.names(), ElementsAre("f"));
}

TEST(WriteFileAtomically, RemovesWhatAKilledProgramLeft) {
  TemporaryFolder folder;
  write_bytes(folder / ".tmp-1-0-g", "of another file");
  write_bytes(folder / ".tmp-x-0-f", "of a person");
  KilledProcess killed([&](const auto& tell) {
    const TemporaryFile file(folder / "f");
    tell();
    ::pause();
  });
  killed.wait_for_step();
  write_file_atomically(folder / "f", "new");
  EXPECT_EQ(folder.names().size(), 4u) << "its program is at work";
  killed.kill();
  write_file_atomically(folder / "f", "newer");
  EXPECT_THAT(folder.names(), ElementsAre(".tmp-1-0-g", ".tmp-x-0-f", "f"));
}

TEST(WriteFileAtomically, WrongPlacesAreNamed) {
  TemporaryFolder folder;
  write_bytes(folder / "file", "x");
  fs::create_directory(folder / "dir");
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "none/f", "x"); }),
              HasSubstr("none/f: cannot be created: No such file"));
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "file/f", "x"); }),
              HasSubstr("file/f: cannot be created: Not a directory"));
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "dir", "x"); }), HasSubstr("dir: is a folder"));
  EXPECT_THAT(message_of([&] { write_file_atomically("", "x"); }), HasSubstr("not the name of a file"));
  EXPECT_THAT(folder.names(), ElementsAre("dir", "file"));
}

TEST(WriteFileAtomically, FollowsALink) {
  TemporaryFolder folder;
  write_bytes(folder / "target", "old");
  fs::create_symlink("target", folder / "link");
  write_file_atomically(folder / "link", "new");
  EXPECT_EQ(read_bytes(folder / "target"), "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
}

TEST(RunFolder, AppearsWholeOrNotAtAll) {
  TemporaryFolder folder;
  {
    const RunFolder run(folder / "a/b/RUN", {});
    write_bytes(run.path() / "report.json", "{}");
    EXPECT_FALSE(fs::exists(folder / "a/b/RUN"));
  }
  EXPECT_TRUE(fs::is_empty(folder / "a/b"));
  {
    RunFolder run((folder / "a/RUN/").string(), {});
    write_bytes(run.path() / "report.json", "{}");
    run.commit();
  }
  EXPECT_EQ(read_bytes(folder / "a/RUN/report.json"), "{}");
}

TEST(RunFolder, OverwritesOnlyWhatIsARunAndOnlyWhenAsked) {
  TemporaryFolder folder;
  fs::create_directory(folder / "RUN");
  write_bytes(folder / "RUN/mesh.ply", "1");
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {}); }),
              HasSubstr("RUN: exists already; name another folder or overwrite it"));
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {.overwrite = true}); }),
              HasSubstr("holds no report.json"));
  write_bytes(folder / "RUN/report.json", "old");
  EXPECT_THAT(message_of([&] {
                RunFolder(folder / "RUN",
                          {.overwrite = true, .inputs = {folder / "RUN2", folder / "RUN/log/gelsight.avi"}});
              }),
              HasSubstr("holds the input"));
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {.overwrite = true, .inputs = {folder / "RUN"}}); }),
              HasSubstr("holds the input"));
  { const RunFolder abandoned(folder / "RUN", {.overwrite = true, .inputs = {"", folder / "RUN2"}}); }
  EXPECT_EQ(read_bytes(folder / "RUN/report.json"), "old");
  RunFolder run(folder / "RUN", {.overwrite = true});
  write_bytes(run.path() / "report.json", "new");
  run.commit();
  EXPECT_EQ(read_bytes(folder / "RUN/report.json"), "new");
  EXPECT_FALSE(fs::exists(folder / "RUN/mesh.ply"));
  EXPECT_THAT(folder.names(), ElementsAre("RUN"));
}

TEST(RunFolder, NeverReplacesWhatAPersonHasPutThere) {
  const TemporaryFolder folder;
  const RunFolderOptions options{.overwrite = true, .known_entries = {"report.json", "mesh.ply"}};
  std::filesystem::create_directory(folder / "RUN");
  write_file_atomically(folder / "RUN/report.json", "x");
  write_file_atomically(folder / "RUN/diary.txt", "dear diary");
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", options); }), HasSubstr("for it holds diary.txt"));
  EXPECT_TRUE(std::filesystem::exists(folder / "RUN/diary.txt"));
  std::filesystem::remove(folder / "RUN/diary.txt");
  RunFolder run(folder / "RUN", options);
  run.commit();
  EXPECT_TRUE(std::filesystem::is_empty(folder / "RUN"));
}

TEST(RunFolder, NeitherReplacesWhatAppearedMeanwhileNorLosesWhatWasToBeThere) {
  TemporaryFolder folder;
  const fs::path kept = folder / ("RUN.kept-" + std::to_string(::getpid()));
  {
    RunFolder run(folder / "RUN", {});
    write_bytes(run.path() / "mesh.ply", "long work");
    fs::create_directory(folder / "RUN");
    write_bytes(folder / "RUN/other", "x");
    EXPECT_THAT(message_of([&] { run.commit(); }),
                testing::AllOf(HasSubstr("RUN: exists already"), HasSubstr("is in " + kept.string())));
  }
  EXPECT_EQ(read_bytes(folder / "RUN/other"), "x");
  EXPECT_EQ(read_bytes(kept / "mesh.ply"), "long work");
}

TEST(RunFolder, NeverReplacesARecording) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "RUN");
  write_bytes(folder / "RUN/report.json", "{}");
  write_bytes(folder / "RUN/log-2.mkv", "pictures");
  for (const RunFolderOptions& options :
       {RunFolderOptions{.overwrite = true},
        RunFolderOptions{.overwrite = true, .known_entries = {"report.json", "log-*"}}})
    EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", options); }),
                HasSubstr("RUN: will not be overwritten, for it holds the recording log-2.mkv"));
  EXPECT_EQ(read_bytes(folder / "RUN/log-2.mkv"), "pictures");
  fs::create_directories(folder / "RUN/mine/old");
  fs::rename(folder / "RUN/log-2.mkv", folder / "RUN/mine/old/log.mkv");
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {.overwrite = true}); }),
              HasSubstr("holds the recording mine/old/log.mkv"));
  fs::rename(folder / "RUN/mine/old/log.mkv", folder / "RUN/mine/gelsight.avi");
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {.overwrite = true}); }),
              HasSubstr("holds mine/gelsight.avi, which is not of this command"));
  EXPECT_EQ(read_bytes(folder / "RUN/mine/gelsight.avi"), "pictures");
}

TEST(RunFolder, EverythingThatASaveWritesOrLeavesMayBeReplaced) {
  const TemporaryFolder folder;
  for (const char* inner : {"", "saving.tmp", "saved.tmp"}) {
    fs::create_directories(folder / "RUN" / inner);
    write_bytes(folder / "RUN" / inner / ".tmp-1-0-mesh.ply", "");
    for (const std::string& name : saved_entries()) write_bytes(folder / "RUN" / inner / name, "");
  }
  for (const char* of_a_killed_scan : {"session.db-wal", "session.db-shm"})
    write_bytes(folder / "RUN" / of_a_killed_scan, "");
  write_bytes(folder / "RUN/screenshot_1.png", "");
  check_run_folder(folder / "RUN", {.overwrite = true});
  check_save(folder / "RUN", "saving.tmp");
  for (const char* mine : {".tmp-x", ".tmp-1-0-hand.avi", "saving.tmp/.tmp-x", "saved.tmp/hand.avi"}) {
    write_bytes(folder / "RUN" / mine, "pictures");
    EXPECT_THAT(message_of([&] { check_run_folder(folder / "RUN", {.overwrite = true}); }),
                HasSubstr(std::string("holds ") + mine + ", which is not of this command"));
    if (std::string(mine).starts_with("sav")) {
      EXPECT_THAT(message_of([&] { check_save(folder / "RUN", fs::path(mine).parent_path().c_str()); }),
                  HasSubstr(std::string(mine) + ": is not of this program, which would remove it"));
    }
    fs::remove(folder / "RUN" / mine);
  }
  const RunFolderOptions marked{.overwrite = true, .marker_text = "ours"};
  EXPECT_THAT(message_of([&] { check_run_folder(folder / "RUN", marked); }),
              HasSubstr("for its report.json is not of this command"));
  write_bytes(folder / "RUN/report.json", "it is ours");
  check_run_folder(folder / "RUN", marked);
}

TEST(RunFolder, KeepsAllOthersOutOfTheFolderThatItReplaces) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "RUN");
  write_bytes(folder / "RUN/report.json", "old");
  const auto refusal = [&] {
    const std::string words = "(core_test, process " + std::to_string(::getpid()) + ") is writing to '" +
                              (folder / "RUN").string() + "'";
    EXPECT_THAT(message_of([&] { check_run_folder(folder / "RUN", {.overwrite = true}); }), HasSubstr(words));
    EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {.overwrite = true}); }), HasSubstr(words));
    return message_of([&] { FolderLock(folder / "RUN"); });
  };
  {
    RunFolder run(folder / "RUN", {.overwrite = true});
    EXPECT_THAT(refusal(), HasSubstr("is writing to"));
    write_bytes(run.path() / "report.json", "new");
    const FolderLock lock = run.commit();
    EXPECT_EQ(read_bytes(folder / "RUN/report.json"), "new");
    EXPECT_THAT(refusal(), HasSubstr("is writing to")) << "whoever goes on writing there";
  }
  const FolderLock free(folder / "RUN");
}

TEST(RunFolder, RemovesWhatAKilledRunLeft) {
  const TemporaryFolder folder;
  KilledProcess killed([&](const auto& tell) {
    const RunFolder run(folder / "RUN", {});
    write_bytes(run.path() / "mesh.ply", "half of it");
    tell();
    ::pause();
  });
  killed.wait_for_step();
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {}); }),
              HasSubstr("process " + std::to_string(killed.id()) + ") is writing to"));
  EXPECT_EQ(left_behind(folder / "RUN"), "") << "its process is at work";
  killed.kill();
  { const RunFolder run(folder / "RUN2", {}); }
  EXPECT_THAT(folder.names(), ElementsAre("RUN.gelslam-tmp")) << "another run's folder";
  EXPECT_THAT(left_behind(folder / "RUN"),
              HasSubstr("RUN.gelslam-tmp was left by a command that was killed"));
  {
    RunFolder run(folder / "RUN", {});
    run.commit();
  }
  EXPECT_THAT(folder.names(), ElementsAre("RUN"));
  EXPECT_TRUE(fs::is_empty(folder / "RUN"));
}

TEST(RunFolder, RemovesNothingThatIsNotOfARun) {
  const TemporaryFolder folder;
  const fs::path temporary = folder / "RUN.gelslam-tmp";
  fs::create_directory(folder / "somebody's");
  write_bytes(folder / "somebody's/diary.txt", "dear diary");
  fs::create_directory_symlink(folder / "somebody's", temporary);
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {}); }), HasSubstr("is there; remove it"));
  EXPECT_TRUE(fs::exists(folder / "somebody's/diary.txt"));
  fs::remove(temporary);
  write_bytes(temporary, "a file");
  EXPECT_THAT(message_of([&] { RunFolder(folder / "RUN", {}); }), HasSubstr("cannot be created"));
  EXPECT_EQ(read_bytes(temporary), "a file");
}

TEST(CheckIsRun, RefusesLinksAndPipesInThePlaceOfFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"mesh.ply", "report.json", "log-2.mkv", "session.db", "session.db-wal"})
    for (const bool is_pipe : {false, true}) {
      fs::remove_all(folder / "RUN");
      fs::create_directories(folder / "RUN");
      write_bytes(folder / "RUN/trajectory.tum", "");
      fs::create_symlink("/etc/hostname", folder / "RUN/a person's own link");
      EXPECT_EQ(message_of([&] { check_is_run(folder / "RUN"); }), "nothing was thrown");
      if (is_pipe)
        ASSERT_EQ(::mkfifo((folder / "RUN" / name).c_str(), 0600), 0);
      else
        fs::create_symlink("/etc/hostname", folder / "RUN" / name);
      EXPECT_THAT(message_of([&] { check_is_run(folder / "RUN"); }),
                  HasSubstr(std::string(name) + ": is a link, pipe or device"));
    }
}

TEST(CheckIsRun, SaysWhatIsMissingAndWhatToDo) {
  const TemporaryFolder folder;
  const auto said = [&](RunNeeds needs) { return message_of([&] { check_is_run(folder / "RUN", needs); }); };
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("RUN: no such run folder"));
  fs::create_directory(folder / "RUN");
  EXPECT_THAT(said(RunNeeds::record), HasSubstr("RUN: is no run folder"));
  write_bytes(folder / "RUN/session.db", "");
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("the scan was not finished; fuse the run to make its map"));
  EXPECT_EQ(said(RunNeeds::record), "nothing was thrown");
  write_bytes(folder / "RUN/mesh.ply", "");
  EXPECT_EQ(said(RunNeeds::map), "nothing was thrown");
  fs::create_directory(folder / "RUN/saved.tmp");
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("its last save is not complete; fuse the run to complete it"));
  EXPECT_EQ(said(RunNeeds::record), "nothing was thrown");
}

}  // namespace
}  // namespace gelslam
