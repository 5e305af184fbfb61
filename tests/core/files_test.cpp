#include "gelslam/core/files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../support/file_size_limit.hpp"
#include "../support/killed_process.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/run_folder.hpp"

namespace gelslam::test {
namespace {

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

std::string second_locker(const fs::path& folder) {
  return message_of([&] { FolderLock{folder}; });
}

TEST(FolderLock, KeepsASecondOneOutUntilTheFirstIsGone) {
  const TemporaryFolder folder;
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
  const TemporaryFolder folder;
  write_bytes(folder / "file", "");
  for (const char* name : {"file", "none"})
    EXPECT_NE(second_locker(folder / name).find(name), std::string::npos);
}

class RunFolders : public testing::Test {
 protected:
  /// Writes a file of the run, and the run if there is none.
  void put(const fs::path& name, const std::string& bytes) const {
    fs::create_directories((place / name).parent_path());
    write_bytes(place / name, bytes);
  }
  std::string refusal(const RunFolderOptions& options = {}) const {
    return message_of([&] { RunFolder(place, options); });
  }

  const TemporaryFolder folder;
  const fs::path place = folder / "RUN";
};
using CheckIsRun = RunFolders;

TEST_F(RunFolders, AppearsWholeOrNotAtAll) {
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

TEST_F(RunFolders, OverwritesOnlyWhatIsARunAndOnlyWhenAsked) {
  put("mesh.ply", "1");
  EXPECT_THAT(refusal(), HasSubstr("RUN: exists already; name another folder or overwrite it"));
  EXPECT_THAT(refusal({.overwrite = true}), HasSubstr("holds no report.json"));
  put("report.json", "old");
  EXPECT_THAT(refusal({.overwrite = true, .inputs = {folder / "RUN2", place / "log/gelsight.avi"}}),
              HasSubstr("holds the input"));
  EXPECT_THAT(refusal({.overwrite = true, .inputs = {place}}), HasSubstr("holds the input"));
  { const RunFolder abandoned(place, {.overwrite = true, .inputs = {"", folder / "RUN2"}}); }
  EXPECT_EQ(read_bytes(place / "report.json"), "old");
  RunFolder run(place, {.overwrite = true});
  write_bytes(run.path() / "report.json", "new");
  run.commit();
  EXPECT_EQ(read_bytes(place / "report.json"), "new");
  EXPECT_FALSE(fs::exists(place / "mesh.ply"));
  EXPECT_THAT(folder.names(), ElementsAre("RUN"));
}

TEST_F(RunFolders, NeverReplacesWhatAPersonHasPutThere) {
  const RunFolderOptions options{.overwrite = true, .known_entries = {"report.json", "mesh.ply"}};
  put("report.json", "x");
  put("diary.txt", "dear diary");
  EXPECT_THAT(refusal(options), HasSubstr("for it holds diary.txt"));
  EXPECT_TRUE(fs::exists(place / "diary.txt"));
  fs::remove(place / "diary.txt");
  RunFolder run(place, options);
  run.commit();
  EXPECT_TRUE(fs::is_empty(place));
}

TEST_F(RunFolders, NeitherReplacesWhatAppearedMeanwhileNorLosesWhatWasToBeThere) {
  const fs::path kept = folder / "RUN.gelslam-tmp";
  {
    RunFolder run(place, {});
    write_bytes(run.path() / "mesh.ply", "long work");
    put("other", "x");
    EXPECT_THAT(message_of([&] { run.commit(); }),
                testing::AllOf(HasSubstr("RUN: exists already"), HasSubstr("is in " + kept.string())));
  }
  EXPECT_EQ(read_bytes(place / "other"), "x");
  EXPECT_EQ(read_bytes(kept / "mesh.ply"), "long work");
}

TEST_F(RunFolders, NeverReplacesARecording) {
  put("report.json", "{}");
  put("log-2.mkv", "pictures");
  for (const RunFolderOptions& options :
       {RunFolderOptions{.overwrite = true},
        RunFolderOptions{.overwrite = true, .known_entries = {"report.json", "log-*"}}})
    EXPECT_THAT(refusal(options),
                HasSubstr("RUN: will not be overwritten, for it holds the recording log-2.mkv"));
  EXPECT_EQ(read_bytes(place / "log-2.mkv"), "pictures");
  fs::create_directories(place / "mine/old");
  fs::rename(place / "log-2.mkv", place / "mine/old/log.mkv");
  EXPECT_THAT(refusal({.overwrite = true}), HasSubstr("holds the recording mine/old/log.mkv"));
  fs::rename(place / "mine/old/log.mkv", place / "mine/gelsight.avi");
  EXPECT_THAT(refusal({.overwrite = true}),
              HasSubstr("holds mine/gelsight.avi, which is not of this command"));
  EXPECT_EQ(read_bytes(place / "mine/gelsight.avi"), "pictures");
}

TEST_F(RunFolders, EverythingThatASaveWritesOrLeavesMayBeReplaced) {
  for (const char* inner : {"", "saving.tmp"}) {
    put(fs::path(inner) / ".tmp-1-0-mesh.ply", "");
    for (const std::string& name : saved_entries()) put(fs::path(inner) / name, "");
  }
  for (const char* of_a_killed_scan : {"session.db-wal", "session.db-shm"}) put(of_a_killed_scan, "");
  put("screenshot_1.png", "");
  check_run_folder(place, {.overwrite = true});
  check_save(place);
  for (const char* mine : {".tmp-x", ".tmp-1-0-hand.avi", "saving.tmp/.tmp-x", "saving.tmp/hand.avi"}) {
    put(mine, "pictures");
    EXPECT_THAT(message_of([&] { check_run_folder(place, {.overwrite = true}); }),
                HasSubstr(std::string("holds ") + mine + ", which is not of this command"));
    if (std::string(mine).starts_with("sav")) {
      EXPECT_THAT(message_of([&] { check_save(place); }),
                  HasSubstr(std::string(mine) + ": is not of this program, which would remove it"));
    }
    fs::remove(place / mine);
  }
  const RunFolderOptions marked{.overwrite = true, .marker_text = "ours"};
  EXPECT_THAT(message_of([&] { check_run_folder(place, marked); }),
              HasSubstr("for its report.json is not of this command"));
  put("report.json", "it is ours");
  check_run_folder(place, marked);
}

TEST_F(RunFolders, KeepsAllOthersOutOfTheFolderThatItReplaces) {
  put("report.json", "old");
  const auto kept_out = [&] {
    const std::string words =
        "(core_test, process " + std::to_string(::getpid()) + ") is writing to '" + place.string() + "'";
    EXPECT_THAT(message_of([&] { check_run_folder(place, {.overwrite = true}); }), HasSubstr(words));
    EXPECT_THAT(refusal({.overwrite = true}), HasSubstr(words));
    return second_locker(place);
  };
  {
    RunFolder run(place, {.overwrite = true});
    EXPECT_THAT(kept_out(), HasSubstr("is writing to"));
    write_bytes(run.path() / "report.json", "new");
    const FolderLock lock = run.commit();
    EXPECT_EQ(read_bytes(place / "report.json"), "new");
    EXPECT_THAT(kept_out(), HasSubstr("is writing to")) << "whoever goes on writing there";
  }
  const FolderLock free(place);
}

TEST_F(RunFolders, RemovesWhatAKilledRunLeft) {
  KilledProcess killed([&](const auto& tell) {
    const RunFolder run(place, {});
    write_bytes(run.path() / "mesh.ply", "half of it");
    tell();
    ::pause();
  });
  killed.wait_for_step();
  EXPECT_THAT(refusal(), HasSubstr("process " + std::to_string(killed.id()) + ") is writing to"));
  EXPECT_EQ(left_behind(place), "") << "its process is at work";
  killed.kill();
  { const RunFolder run(folder / "RUN2", {}); }
  EXPECT_THAT(folder.names(), ElementsAre("RUN.gelslam-tmp")) << "another run's folder";
  EXPECT_THAT(left_behind(place),
              HasSubstr("RUN.gelslam-tmp was left by a command that did not end: rename it to keep"));
  {
    RunFolder run(place, {});
    run.commit();
  }
  EXPECT_THAT(folder.names(), ElementsAre("RUN"));
  EXPECT_TRUE(fs::is_empty(place));
}

TEST_F(RunFolders, RemovesNothingThatIsNotOfARun) {
  const fs::path temporary = folder / "RUN.gelslam-tmp";
  fs::create_directory(folder / "somebody's");
  write_bytes(folder / "somebody's/diary.txt", "dear diary");
  fs::create_directory_symlink(folder / "somebody's", temporary);
  EXPECT_THAT(refusal(), HasSubstr("is there; remove it"));
  EXPECT_TRUE(fs::exists(folder / "somebody's/diary.txt"));
  fs::remove(temporary);
  write_bytes(temporary, "a file");
  EXPECT_THAT(refusal(), HasSubstr("cannot be created"));
  EXPECT_EQ(read_bytes(temporary), "a file");
}

TEST_F(CheckIsRun, RefusesLinksAndPipesInThePlaceOfFiles) {
  for (const char* name : {"mesh.ply", "report.json", "log-2.mkv", "session.db", "session.db-wal"})
    for (const bool is_pipe : {false, true}) {
      fs::remove_all(place);
      put("trajectory.tum", "");
      fs::create_symlink("/etc/hostname", place / "a person's own link");
      EXPECT_EQ(message_of([&] { check_is_run(place); }), "nothing was thrown");
      if (is_pipe)
        ASSERT_EQ(::mkfifo((place / name).c_str(), 0600), 0);
      else
        fs::create_symlink("/etc/hostname", place / name);
      EXPECT_THAT(message_of([&] { check_is_run(place); }),
                  HasSubstr(std::string(name) + ": is a link, pipe or device"));
    }
}

TEST_F(CheckIsRun, SaysWhatIsMissingAndWhatToDo) {
  const auto said = [&](RunNeeds needs) { return message_of([&] { check_is_run(place, needs); }); };
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("RUN: no such run folder"));
  fs::create_directory(place);
  EXPECT_THAT(said(RunNeeds::record), HasSubstr("RUN: is no run folder"));
  put("session.db", "");
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("the scan was not finished; fuse the run to make its map"));
  EXPECT_EQ(said(RunNeeds::record), "nothing was thrown");
  put("mesh.ply", "");
  EXPECT_EQ(said(RunNeeds::map), "nothing was thrown");
  RunReport killed;
  killed.saved = false;
  put("report.json", report_json(killed));
  EXPECT_THAT(said(RunNeeds::map), HasSubstr("the scan was not finished; fuse the run to make its map"));
  EXPECT_EQ(said(RunNeeds::record), "nothing was thrown");
}

}  // namespace
}  // namespace gelslam::test
