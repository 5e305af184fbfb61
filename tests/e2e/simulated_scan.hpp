#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "../support/run_program.hpp"

namespace gelslam::test {

inline constexpr int kBackgroundFrames = 10, kScanFrames = 80;

/// The built program.
ProgramResult gelslam(const std::vector<std::string>& arguments);

/// A peanut wobbled over a sensor that was calibrated on few presses. One for all tests of a process.
class SimulatedScan : public testing::Environment {
 public:
  void SetUp() override;
  void TearDown() override { folder_.reset(); }
  std::filesystem::path log() const { return *folder_ / "scan"; }
  std::filesystem::path model() const { return log() / "model.json"; }
  /// What reconstruct makes of the log, made once: to read, or to copy.
  std::filesystem::path run() const;

 private:
  std::unique_ptr<TemporaryFolder> folder_;
};

SimulatedScan& scan();

std::vector<std::string> lines_of(const std::string& text);

/// A run folder with all its files, which agree with each other.
void expect_complete(const std::filesystem::path& run);

/// What the session holds, whoever wrote it.
std::string saved_session(const std::filesystem::path& run);

/// The scan to and fro, as a folder of pictures of any length.
void write_long_log(const std::filesystem::path& folder, int frames);

/// Starts the program and does not wait; its standard output goes to `out`, if that is given.
pid_t start_program(const std::vector<std::string>& arguments, const std::filesystem::path& out = "");
/// Waits for its end; minus the signal that ended it.
int exit_code_of(pid_t child);

/// Starts the program, asks it to stop (as Ctrl-C does) after `after_s` of processor time; its exit code.
int run_interrupted(const std::vector<std::string>& arguments, double after_s);
/// The same with any signal; minus its number when it ended the program.
int run_signalled(const std::vector<std::string>& arguments, double after_s, int signal);

}  // namespace gelslam::test
