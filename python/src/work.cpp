#include <fmt/core.h>
#include <pybind11/stl.h>

#include "bind.hpp"

namespace gelslam::python {

void check_signals() {
  const WithGil gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void warn(const std::string& message) {
  constexpr int kCaller = 1;
  if (PyErr_WarnEx(PyExc_UserWarning, message.c_str(), kCaller) != 0) throw py::error_already_set();
}

PythonProgress::PythonProgress(py::object target)
    : target_(std::move(target)),
      silent_(target_.is_none() || target_.is(py::bool_(false))),
      to_stderr_(target_.is(py::bool_(true))) {
  if (!silent_ && !to_stderr_ && PyCallable_Check(target_.ptr()) == 0)
    throw py::type_error("progress: expected True, False or a function of (task, done, total)");
}

void PythonProgress::begin(std::string_view task, std::optional<std::int64_t> total) {
  task_ = task;
  total_ = total;
  done_ = 0;
  tell();
}

void PythonProgress::update(std::int64_t done) {
  constexpr std::chrono::milliseconds kBetweenLines(100);
  check_signals();
  done_ = done;
  if (std::chrono::steady_clock::now() - told_ > kBetweenLines) tell();
}

void PythonProgress::end() {
  check_signals();
  tell();
  if (!to_stderr_) return;
  const WithGil gil;
  py::print("", py::arg("file") = py::module_::import("sys").attr("stderr"));
}

void PythonProgress::tell() {
  told_ = std::chrono::steady_clock::now();
  if (silent_) return;
  const WithGil gil;
  if (!to_stderr_) {
    target_(task_, done_, total_);
    return;
  }
  const std::string line =
      total_ ? fmt::format("\r{} {}/{}", task_, done_, *total_) : fmt::format("\r{} {}", task_, done_);
  py::print(line, py::arg("file") = py::module_::import("sys").attr("stderr"), py::arg("end") = "",
            py::arg("flush") = true);
}

}  // namespace gelslam::python
