#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "temporary_folder.hpp"

extern char** environ;

namespace gelslam::test {

struct ProgramResult {
  int exit_code = -1;  ///< minus the signal's number when one ended it
  std::string out, err;
  std::ptrdiff_t error_lines() const { return std::count(err.begin(), err.end(), '\n'); }
};

/// Runs `program` with `arguments` to its end, its input empty and its outputs caught in files (no terminal).
/// `out` replaces the file that standard output goes to.
inline ProgramResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                                 const std::string& out = "") {
  const TemporaryFolder folder;
  const std::string out_path = out.empty() ? (folder / "out").string() : out,
                    err_path = (folder / "err").string();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out_path.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err_path.c_str(), O_WRONLY | O_CREAT, 0600);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error("cannot start " + program);
  int status = 0;
  ::waitpid(child, &status, 0);
  ProgramResult result;
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  if (out.empty()) result.out = read_bytes(out_path);
  result.err = read_bytes(err_path);
  return result;
}

/// What a shell command prints on a terminal.
inline std::string on_terminal(const std::string& command) {
  return run_program("/usr/bin/script", {"-qec", command, "/dev/null"}).out;
}

/// What every mistake of a person must look like: exit code 2, nothing on stdout, one line on stderr that
/// holds `words`.
inline void expect_mistake(const ProgramResult& result, const std::string& words,
                           const std::string& program = "gelslam") {
  EXPECT_EQ(result.exit_code, 2) << words;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.error_lines(), 1) << result.err;
  EXPECT_THAT(result.err, testing::StartsWith(program + ": error: "));
  EXPECT_THAT(result.err, testing::HasSubstr(words));
}

}  // namespace gelslam::test
