#pragma once

#include <cxxabi.h>
#include <pybind11/pybind11.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "gelslam/core/progress.hpp"
#include "gelslam/registration/registration.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam::python {

namespace py = pybind11;
using OptionalPath = std::optional<std::filesystem::path>;

[[noreturn]] void wait_for_the_end();

/// Takes the GIL. Once the interpreter ends, Python terminates a thread that requests it, which C++ code does
/// not survive. Such a thread therefore waits here for the end of the program.
template <typename Take>
void take_gil(const Take& take) {
  try {
    take();
  } catch (abi::__forced_unwind&) {
    wait_for_the_end();
  }
}

/// Releases the GIL during its lifetime, so that other Python threads can run. No call of this module may be
/// active at the end of the interpreter, because the static objects of libraries are destroyed next.
class WithoutGil {
 public:
  WithoutGil();
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

 private:
  PyThreadState* state_;
};

/// Called when the interpreter begins to end: interrupts the calls of other threads (check_signals()) and
/// waits until they have ended. Later calls wait for the end of the program.
void end_calls();

class WithGil {
 public:
  WithGil() {
    take_gil([&] { gil_.emplace(); });
  }

 private:
  std::optional<py::gil_scoped_acquire> gil_;
};

/// To be given to every class. Without its own `__new__`, pickling with protocol 0 or 1 would call that of
/// pybind11's base class, which crashes the interpreter.
inline const py::custom_type_setup kOwnNew([](PyHeapTypeObject* type) {
  type->ht_type.tp_new = py::detail::pybind11_object_new;
});

/// Each of these functions adds its classes and functions to the module.
void bind_surface(py::module_& module);       // Surface, Sensor
void bind_registration(py::module_& module);  // Registration, register
void bind_run(py::module_& module);           // Mesh, Run, reconstruct, read_run, fuse
void bind_slam(py::module_& module);          // TrackedFrame, Slam
void bind_localization(py::module_& module);  // Map, Place, LocatedFrame, Localizer
void bind_frames(py::module_& module);        // Log, Recorder, Camera
void bind_calibration(py::module_& module);   // calibrate

/// Returns the named configuration with the named model; the default configuration if none is named.
Config config_of(const OptionalPath& config, const OptionalPath& model);

/// Issues a message as a Python warning. The GIL must be held.
void warn(const std::string& message);

/// Returns why a registration failed or, for a successful one, which motions are not observable; else "".
std::string reason_of(const RegistrationResult& result);

/// Called by long work without the GIL. Throws KeyboardInterrupt after Ctrl-C, which Python delivers to its
/// main thread only, and Error in other threads once the interpreter ends.
void check_signals();

/// Reports the progress of work that runs without the GIL, and makes it interruptible by Ctrl-C. Must be
/// created while the GIL is held.
class PythonProgress final : public ProgressSink {
 public:
  /// `target` is False or None, True (a line on stderr), or a function of (task, done, total or None). Throws
  /// TypeError for anything else.
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
