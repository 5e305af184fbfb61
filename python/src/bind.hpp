#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <optional>
#include <string>

#include "gelslam/registration/registration.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam::python {

namespace py = pybind11;
using OptionalPath = std::optional<std::filesystem::path>;

/// Each adds its classes and functions to the module.
void bind_surface(py::module_& module);       // Surface, Sensor
void bind_registration(py::module_& module);  // Registration, register
void bind_run(py::module_& module);           // Mesh, Run, reconstruct, read_run
void bind_slam(py::module_& module);          // TrackedFrame, Slam
void bind_frames(py::module_& module);        // Log, Camera
void bind_calibration(py::module_& module);   // calibrate

/// The named configuration and model; the default configuration without a name.
Config config_of(const OptionalPath& config, const OptionalPath& model);

/// Why a registration failed; of one that succeeded, which motions are not observable; else "".
std::string reason_of(const RegistrationResult& result);

}  // namespace gelslam::python
