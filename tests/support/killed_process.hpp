#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <stdexcept>

namespace gelslam::test {

/// A process that works until it is killed, and tells how far it is.
class KilledProcess {
 public:
  using Tell = std::function<void()>;

  /// `work` runs in the process, and calls what it is given after each of its steps.
  explicit KilledProcess(const std::function<void(const Tell&)>& work) {
    if (::pipe(steps_) != 0) throw std::runtime_error("no pipe");
    id_ = ::fork();
    if (id_ == 0) {
      work([this] {
        if (::write(steps_[1], "x", 1) != 1) ::_exit(1);
      });
      ::_exit(4);
    }
    ::close(steps_[1]);
  }
  ~KilledProcess() { ::close(steps_[0]); }
  KilledProcess(const KilledProcess&) = delete;
  KilledProcess& operator=(const KilledProcess&) = delete;

  pid_t id() const { return id_; }
  void wait_for_step() {
    char byte = 0;
    ASSERT_EQ(::read(steps_[0], &byte, 1), 1);
    ++told_;
  }
  /// Returns how many steps it has told of.
  int kill() {
    int status = 0;
    ::kill(id_, SIGKILL);
    ::waitpid(id_, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "it had ended";
    for (char byte = 0; ::read(steps_[0], &byte, 1) == 1;) ++told_;
    return told_;
  }

 private:
  int steps_[2] = {-1, -1};
  pid_t id_ = 0;
  int told_ = 0;
};

}  // namespace gelslam::test
