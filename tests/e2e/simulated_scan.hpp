#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "../support/run_program.hpp"

namespace gelslam::test {

inline constexpr int kBackgroundFrames = 10, kScanFrames = 80;

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

/// A run folder with all its files, which agree with each other.
void expect_complete(const std::filesystem::path& run);

/// What the session holds, whoever wrote it.
std::string saved_session(const std::filesystem::path& run);

/// The scan to and fro, as a folder of pictures of any length.
void write_long_log(const std::filesystem::path& folder, int frames);

/// Starts the program and sends it a signal after `after_s` of processor time. Returns its exit code, or
/// minus the signal that ended it.
int run_signalled(const std::vector<std::string>& arguments, double after_s, int signal);

}  // namespace gelslam::test
