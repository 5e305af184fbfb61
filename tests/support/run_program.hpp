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

/// Starts `program` and does not wait; its input is empty, and its outputs go to files where they are named.
inline pid_t start_program(const std::string& program, const std::vector<std::string>& arguments,
                           const std::string& out = "", const std::string& err = "") {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  for (const auto& [descriptor, path] : {std::pair(1, &out), std::pair(2, &err)})
    if (!path->empty())
      posix_spawn_file_actions_addopen(&actions, descriptor, path->c_str(), O_WRONLY | O_CREAT, 0600);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error("cannot start " + program);
  return child;
}

/// Waits for its end; minus the signal that ended it.
inline int exit_code_of(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

/// Runs `program` to its end, its outputs caught (no terminal). `out` replaces the file that standard output
/// goes to.
inline ProgramResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                                 const std::string& out = "") {
  const TemporaryFolder folder;
  const std::string out_path = out.empty() ? (folder / "out").string() : out,
                    err_path = (folder / "err").string();
  ProgramResult result;
  result.exit_code = exit_code_of(start_program(program, arguments, out_path, err_path));
  if (out.empty()) result.out = read_bytes(out_path);
  result.err = read_bytes(err_path);
  return result;
}

#ifdef GELSLAM_PROGRAM
inline ProgramResult gelslam(const std::vector<std::string>& arguments, const std::string& out = "") {
  return run_program(GELSLAM_PROGRAM, arguments, out);
}
#endif

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
