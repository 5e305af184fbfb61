#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam {

/// This program begins anew with other arguments, in the same process. Throws Error.
[[noreturn]] void become(const std::vector<std::string>& arguments);

/// This program once more, as a process of its own with other arguments: no input, its output is kept. It is
/// not in the terminal's foreground group, so that Ctrl-C reaches it only by interrupt().
class ChildProgram {
 public:
  /// Throws Error when the system has no room for another process.
  explicit ChildProgram(const std::vector<std::string>& arguments);
  /// Interrupts it and waits for its end.
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

  void interrupt() const;
  /// Its exit code, or minus the signal that ended it; nothing while it runs. Does not wait.
  std::optional<int> exit_code();
  /// What it printed last, without the line break.
  std::string last_line() const;

 private:
  FileDescriptor output_;
  pid_t pid_ = 0;
  std::optional<int> exit_code_;
};

}  // namespace gelslam
