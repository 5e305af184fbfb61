#include <fmt/core.h>
#include <pybind11/stl.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "bind.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::python {
namespace {

std::mutex calls_mutex;
std::condition_variable call_ended;
int calls = 0;  // Number of calls that run without the GIL, in all threads.
std::optional<std::thread::id> ending_thread;

/// Says whether this thread must not work any more. The mutex must be held.
bool has_ended() { return ending_thread && *ending_thread != std::this_thread::get_id(); }

/// Changes the number of running calls by `change`. Does not return once the interpreter ends.
void count_calls(int change) {
  {
    const std::lock_guard lock(calls_mutex);
    if (change < 0 || !has_ended()) calls += change;
    if (!has_ended()) return;
  }
  call_ended.notify_all();
  wait_for_the_end();
}

}  // namespace

void wait_for_the_end() {
  for (;;) ::pause();
}

WithoutGil::WithoutGil() : state_(PyEval_SaveThread()) { count_calls(1); }

WithoutGil::~WithoutGil() {
  count_calls(-1);
  take_gil([&] { PyEval_RestoreThread(state_); });
}

void end_calls() {
  // Limit for a progress function of the caller that never returns.
  constexpr std::chrono::seconds kLongest(10);
  PyThreadState* const state = PyEval_SaveThread();
  {
    std::unique_lock lock(calls_mutex);
    ending_thread = std::this_thread::get_id();
    call_ended.wait_for(lock, kLongest, [] { return calls == 0; });
  }
  PyEval_RestoreThread(state);
}

void check_signals() {
  {
    const std::lock_guard lock(calls_mutex);
    if (has_ended()) throw Error("the interpreter ends");
  }
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
