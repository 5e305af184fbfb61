#include <exception>
#include <filesystem>

#include "bind.hpp"
#include "gelslam/core/error.hpp"

namespace {

namespace py = pybind11;

/// Raises gelslam.Error. The message may contain file names that are not UTF-8.
void raise_error(const std::string& message) {
  const auto decoded = py::reinterpret_steal<py::object>(PyUnicode_DecodeFSDefault(message.c_str()));
  PyErr_SetObject(py::module_::import("gelslam._core").attr("Error").ptr(), decoded.ptr());
}

/// Converts errors of the standard library, for example about files, to the same exception as those of
/// gelslam.
void translate_errors(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const gelslam::Error& error) {
    raise_error(error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    raise_error(error.path1().string() + ": " + error.code().message());
  }
}

/// Refuses objects made by `__new__` without a constructor. Their memory is requested at the first use.
void* refuse_unmade(std::size_t) { throw py::type_error("the object was not made by its constructor"); }

}  // namespace

PYBIND11_MODULE(_core, module) {
  module.attr("__version__") = GELSLAM_VERSION;
  py::exception<gelslam::Error>(module, "Error").doc() =
      "A mistake in the input. The text is one line: what is wrong, where, and what to do.";
  py::register_exception_translator(&translate_errors);
  gelslam::python::bind_surface(module);
  gelslam::python::bind_registration(module);
  gelslam::python::bind_run(module);
  gelslam::python::bind_slam(module);
  gelslam::python::bind_localization(module);
  gelslam::python::bind_frames(module);
  gelslam::python::bind_calibration(module);
  for (const auto& [name, value] : module.attr("__dict__").cast<py::dict>())
    if (py::isinstance<py::type>(value))
      if (auto* const type = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr())))
        type->operator_new = refuse_unmade;
  py::module_::import("atexit").attr("register")(py::cpp_function(&gelslam::python::end_calls));
}
