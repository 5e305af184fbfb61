#include <exception>
#include <filesystem>

#include "bind.hpp"
#include "gelslam/core/error.hpp"

namespace {

namespace py = pybind11;

/// What the disk says becomes the same exception as what we say.
void translate_disk_errors(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string text = error.path1().string() + ": " + error.code().message();
    PyErr_SetString(py::module_::import("gelslam._core").attr("Error").ptr(), text.c_str());
  }
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.attr("__version__") = GELSLAM_VERSION;
  py::register_exception<gelslam::Error>(module, "Error").doc() =
      "A mistake in the input. The text is one line: what is wrong, where, and what to do.";
  py::register_exception_translator(&translate_disk_errors);
  gelslam::python::bind_surface(module);
  gelslam::python::bind_registration(module);
  gelslam::python::bind_run(module);
  gelslam::python::bind_slam(module);
  gelslam::python::bind_frames(module);
  gelslam::python::bind_calibration(module);
}
