#include <pybind11/stl.h>

#include <array>

#include "bind.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/registration/relocalization.hpp"
#include "sensor.hpp"

namespace gelslam::python {
namespace {

py::dict observable_of(const RegistrationResult& result) {
  constexpr std::array<const char*, 6> kMotions = {"x", "y", "z", "rx", "ry", "rz"};
  py::dict observable;
  for (std::size_t i = 0; i < kMotions.size(); ++i) observable[kMotions[i]] = result.observable[i];
  return observable;
}

py::array_t<double> covariance_of(const RegistrationResult& result) {
  PoseGraphEdge edge;
  edge.from_T_to = result.target_T_reference;
  edge.information = result.information;
  return scaled_array_of(uncertain_motion(edge).from_T_to.covariance, kMetersPerMm);
}

RegistrationResult register_surfaces(const TouchedSurface& reference, const TouchedSurface& target,
                                     const std::optional<py::object>& initial, bool search) {
  const Pose start = initial ? pose_of(*initial, "initial") : Pose::Identity();
  const WithoutGil release;
  require_pixels(*target.maps, reference.maps->height_mm.size(), reference.maps->pixel_pitch_mm, "target");
  const NormalFlowOptions options;
  const NormalFlowReference prepared(reference.maps, options);
  const RegistrationResult found = register_normal_flow(prepared, *target.maps, start, options);
  if (found.ok() || !search) return found;
  return relocalize(prepared, *target.maps, start, found, options, {});
}

}  // namespace

std::string reason_of(const RegistrationResult& result) {
  return result.ok() ? describe_observability(result.observable) : std::string(describe(result.status));
}

void bind_registration(py::module_& module) {
  py::class_<RegistrationResult>(module, "Registration", kOwnNew, R"(How two surfaces lie to each other.

Matrices of translations and rotations have the order x, y, z, rx, ry, rz, in meters and radians.)")
      .def_property_readonly(
          "target_T_reference",
          [](const RegistrationResult& self) { return array_of(self.target_T_reference); },
          "4x4: takes coordinates in the first surface's frame to the second's; translation in meters.")
      .def_property_readonly(
          "information",
          [](const RegistrationResult& self) {
            return scaled_array_of(self.information, 1.0 / kMetersPerMm);
          },
          "6x6: inverse covariance of `noise` in true = target_T_reference * exp(noise), along the axes of "
          "the\n"
          "first surface's frame. Nearly 0 along motions that the surfaces do not show.")
      .def_property_readonly("covariance", &covariance_of,
                             "6x6: the same as covariance. Motions that are not shown have 1 rad and 20 mm.")
      .def_property_readonly("observable", &observable_of,
                             "dict of x, y, z, rx, ry, rz: whether both surfaces show this motion, along the "
                             "second's axes.")
      .def_property_readonly("ok", &RegistrationResult::ok, "Whether the registration succeeded.")
      .def_property_readonly("reason", &reason_of,
                             "Why it failed; or which motions are not observable; or \"\".")
      .def_readonly("scr", &RegistrationResult::scr, "Shared curvature ratio, 0..1.")
      .def_readonly("ccs", &RegistrationResult::ccs, "Curvature cosine similarity, -1..1.")
      .def_readonly("normal_rmse_rad", &RegistrationResult::normal_rmse_rad,
                    "Root mean square angle between aligned normals, rad.")
      .def_readonly("height_rmse_mm", &RegistrationResult::height_rmse_mm,
                    "Root mean square height difference, mm.")
      .def_readonly("shared_samples", &RegistrationResult::shared_samples,
                    "Pixels of the reference that were compared, chosen from its contact, and lie in both.")
      .def_readonly("iterations", &RegistrationResult::iterations, "Iterations that it took.")
      .def("__repr__", [](const RegistrationResult& self) {
        return "<gelslam.Registration " + (self.ok() ? std::string("ok") : reason_of(self)) + ">";
      });

  module.def("register", &register_surfaces, py::arg("reference"), py::arg("target"), py::kw_only(),
             py::arg("initial") = py::none(), py::arg("search") = false,
             R"(Registers two surfaces with NormalFlow: how did the sensor move between them?

initial: 4x4, meters: where to begin (target_T_reference); default: no motion. search: if that fails, look for the
place among all shifts, and twists within 20 degrees of `initial`. Returns a Registration. A failure is
a result, not an exception: see its `ok` and `reason`.)");
}

}  // namespace gelslam::python
