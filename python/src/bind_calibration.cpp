#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bind.hpp"
#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::python {
namespace {

namespace fs = std::filesystem;

struct PythonCalibration {
  std::string verdict;
  std::vector<std::string> reasons;
  double slope_error_deg = 0, scale_x = 0, scale_y = 0;
  std::size_t presses = 0;
  std::vector<std::string> left_out;
};

PythonCalibration calibrate_presses(const fs::path& presses, const fs::path& output,
                                    const OptionalPath& settings, std::optional<double> pixel_pitch_mm,
                                    bool automatic, std::optional<int> steps, std::uint64_t seed,
                                    bool overwrite, const py::object& progress) {
  PythonProgress sink(progress);
  const WithoutGil release;
  const Config config = find_config({.config = settings.value_or("")});
  const double pitch_mm = pixel_pitch_mm.value_or(config.surface.pixel_pitch_mm);
  if (!(pitch_mm > 0)) throw Error("pixel_pitch_mm: expected millimeters per pixel");
  if (steps && *steps < 1) throw Error("steps: expected a number of training steps");
  if (!overwrite && fs::exists(output)) throw Error(output.string() + " is already there: give overwrite");
  ModelTraining training{.pixel_pitch_mm = pitch_mm, .seed = seed};
  if (steps) training.steps = *steps;
  PythonCalibration result;
  const auto leave_out = [&](const std::string& press) { result.left_out.push_back(press); };
  PressSet set = read_press_set(presses);
  prepare(set, config.surface.optics, pitch_mm, config.sensor.device_name, [](const std::string& warning) {
    const WithGil gil;
    warn(warning);
  });
  const Calibration calibration = calibrate(set, training, automatic, sink, leave_out);
  if (output.extension() == ".pth")
    write_pth_model(output, calibration.file.model);
  else
    write_model_file(output, calibration.file);
  const ModelCheck& check = calibration.check;
  result.verdict = verdict_name(check.verdict);
  result.reasons = check.reasons;
  result.slope_error_deg = check.slopes.all.mean_abs_error_deg();
  result.scale_x = check.slopes.all.scale_x();
  result.scale_y = check.slopes.all.scale_y();
  result.presses = check.presses.size();
  return result;
}

py::tuple gradient_scale(const PythonCalibration& calibration) {
  return py::make_tuple(calibration.scale_x, calibration.scale_y);
}

}  // namespace

void bind_calibration(py::module_& module) {
  py::class_<PythonCalibration>(module, "Calibration", kOwnNew,
                                "How a new model reads the presses that it was trained on.")
      .def_readonly("verdict", &PythonCalibration::verdict, "\"good\", \"usable\" or \"recalibrate\".")
      .def_readonly("reasons", &PythonCalibration::reasons, "What is not good, worst first: list of str.")
      .def_readonly("slope_error_deg", &PythonCalibration::slope_error_deg,
                    "Mean absolute error of the slopes, degrees.")
      .def_property_readonly("gradient_scale", gradient_scale, "Read over true slope along x and y.")
      .def_readonly("presses", &PythonCalibration::presses, "Number of presses that were used.")
      .def_readonly("left_out", &PythonCalibration::left_out, "Presses that were not, and why: list of str.");

  module.def(
      "calibrate", &calibrate_presses, py::arg("presses"), py::arg("output"), py::kw_only(),
      py::arg("config") = py::none(), py::arg("pixel_pitch_mm") = py::none(), py::arg("automatic") = true,
      py::arg("steps") = py::none(), py::arg("seed") = ModelTraining{}.seed, py::arg("overwrite") = false,
      py::arg("progress") = false,
      R"(Trains a model on a folder of ball presses, as `gelslam calibrate train` does. Returns a Calibration.

presses: catalog.csv, background.png and a folder per press; its optics.yaml, else the configuration's optics, are
trained for. config: default: GelSight Mini. pixel_pitch_mm: default: the configuration's. output: the model; PyTorch's format if it ends in .pth,
else GelSLAM's own. automatic: also use presses that nobody has labeled. steps: default 36000, about 90 s. progress: as
of reconstruct().)");
}

}  // namespace gelslam::python
