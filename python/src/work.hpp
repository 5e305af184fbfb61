#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <string>

#include "gelslam/core/progress.hpp"

namespace gelslam::python {

namespace py = pybind11;

/// Long work calls it without the GIL: throws KeyboardInterrupt after Ctrl-C. Python delivers Ctrl-C to its
/// main thread only.
void check_signals();

/// Progress of work that runs without the GIL. It also lets Ctrl-C in. To be made with the GIL held.
class PythonProgress final : public ProgressSink {
 public:
  /// `target`: False or None, True (a line on stderr), or a function of (task, done, total or None). Throws
  /// TypeError for all else.
  explicit PythonProgress(py::object target);
  void begin(std::string_view task, std::optional<std::int64_t> total) override;
  void update(std::int64_t done) override;
  void end() override;

 private:
  void tell();

  py::object target_;
  bool silent_, to_stderr_;
  std::string task_;
  std::optional<std::int64_t> total_;
  std::int64_t done_ = 0;
  std::chrono::steady_clock::time_point told_;
};

}  // namespace gelslam::python
