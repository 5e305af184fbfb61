#include "child_program.hpp"

#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>

#include <array>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

int exit_code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status); }

/// As the system wants a command line; `arguments` must stay.
std::vector<char*> command_line_of(const std::vector<std::string>& arguments) {
  std::vector<char*> words{const_cast<char*>("gelslam")};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  return words;
}

}  // namespace

void become(const std::vector<std::string>& arguments) {
  ::execv("/proc/self/exe", command_line_of(arguments).data());
  throw Error("cannot start gelslam anew: " + errno_text());
}

ChildProgram::ChildProgram(const std::vector<std::string>& arguments)
    : output_(::memfd_create("output", MFD_CLOEXEC)) {
  const std::vector<char*> words = command_line_of(arguments);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, output_.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, output_.get(), STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // a group of its own
  errno = ::posix_spawn(&pid_, "/proc/self/exe", &files, &attributes, words.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (errno != 0) throw Error("cannot start another process: " + errno_text());
}

ChildProgram::~ChildProgram() {
  if (exit_code()) return;
  interrupt();
  ::waitpid(pid_, nullptr, 0);
}

void ChildProgram::interrupt() const {
  if (!exit_code_) ::kill(pid_, SIGINT);
}

std::optional<int> ChildProgram::exit_code() {
  int status = 0;
  if (!exit_code_ && ::waitpid(pid_, &status, WNOHANG) == pid_) exit_code_ = exit_code_of(status);
  return exit_code_;
}

std::string ChildProgram::last_line() const {
  std::array<char, 4096> end{};
  const off_t size = ::lseek(output_.get(), 0, SEEK_END);
  const auto length = std::min<off_t>(size, end.size());
  const ssize_t count = ::pread(output_.get(), end.data(), static_cast<std::size_t>(length), size - length);
  std::string text(end.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  text.erase(text.find_last_not_of('\n') + 1);
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace gelslam
