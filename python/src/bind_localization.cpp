#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <mutex>

#include "arrays.hpp"
#include "bind.hpp"
#include "frame.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "sensor.hpp"

namespace gelslam::python {
namespace {

namespace fs = std::filesystem;

/// A map that was read, or made from a mesh.
struct PythonMap {
  fs::path source;  ///< Folder or mesh file.
  std::vector<PosedSurface> patches;
  std::optional<MeshMap> made;  ///< Set if it was made from `mesh`.
  Mesh mesh{};
};

PythonMap open_map(const fs::path& path) {
  MapSnapshot session;
  {
    const WithoutGil release;
    session = read_map(path);
  }
  if (!session.warning.empty()) warn(session.warning);
  return {path, posed_surfaces(session), {}};
}

#ifdef GELSLAM_BUILD_SIMULATION
PythonMap map_of_mesh(const fs::path& path, const std::string& unit, const OptionalPath& config,
                      double indentation_mm, int touches, const py::object& progress) {
  PythonProgress sink(progress);
  PythonMap map{path, {}, {}};
  {
    const WithoutGil release;
    LogInput input;
    input.config = config.value_or("");
    const CameraModel camera = configured_camera(find_config(input));
    map.mesh = read_mesh(path, named_unit_mm(path, unit));
    map.made = make_mesh_map(map.mesh, {camera, indentation_mm, touches}, sink);
    map.patches = map.made->patches;
  }
  if (!map.made->warning.empty()) warn(map.made->warning);
  return map;
}
#endif

void save_map_of_mesh(const PythonMap& self, const fs::path& path, bool overwrite) {
  if (!self.made) throw Error("this map was read from " + self.source.string() + ": copy that folder");
  const WithoutGil release;
  RunFolder folder(path, map_folder_options(self.source, overwrite));
  write_map(folder.path(), *self.made, self.mesh, fs::absolute(self.source).string());
  folder.commit();
}

py::array_t<double> poses_of_map(const PythonMap& self) {
  std::vector<StampedPose> poses;
  for (const PosedSurface& patch : self.patches)
    poses.push_back({static_cast<double>(patch.id), patch.map_T_keyframe});
  return poses_of(poses);
}

struct LocatedFrame {
  FrameReport report;

  const std::vector<PlaceHypothesis>& places() const { return report.localization->hypotheses; }
};

py::array_t<double> pose_of_place(const PlaceHypothesis& place) { return array_of(place.map_T_sensor.pose); }
py::array_t<double> covariance_of_place(const PlaceHypothesis& place) {
  return scaled_array_of(place.map_T_sensor.covariance, kMetersPerMm);
}
py::array_t<double> sigma_mm_of_place(const PlaceHypothesis& place) {
  return sigma_mm_of(sigma_of(place.map_T_sensor.covariance));
}
py::array_t<double> sigma_rad_of_place(const PlaceHypothesis& place) {
  return sigma_rad_of(sigma_of(place.map_T_sensor.covariance));
}

template <auto part>
std::optional<py::array_t<double>> of_certain(const LocatedFrame& self) {
  if (!self.report.in_map) return std::nullopt;
  return part(self.places().front());
}

/// Localizes the sensor in a map. Calls from several threads wait for each other.
class MapLocalizer {
 public:
  MapLocalizer(std::shared_ptr<Sensor> sensor, const PythonMap& map, ProgressSink& progress)
      : sensor_(std::move(sensor)),
        localizer_(surfaces_of(*sensor_, map, progress), sensor_->config().slam) {}

  LocatedFrame process(const SurfacePtr& surface, double time_s) {
    const std::lock_guard lock(mutex_);
    require_pixels(*surface, sensor_->background().size(), sensor_->config().surface.pixel_pitch_mm,
                   "surface");
    times_.check(time_s);
    return {without_surfaces(localizer_.process(frames_++, time_s, surface))};
  }
  LocatedFrame process(const cv::Mat3b& bgr, double time_s) {
    return process(sensor_->estimate(bgr, "image").maps, time_s);
  }

 private:
  static std::shared_ptr<const SurfaceMap> surfaces_of(const Sensor& sensor, const PythonMap& map,
                                                       ProgressSink& progress) {
    check_pixel_pitch(map.patches, sensor.config().surface.pixel_pitch_mm, map.source.string());
    return std::make_shared<const SurfaceMap>(map.patches, sensor.config().slam, &progress);
  }

  const std::shared_ptr<Sensor> sensor_;
  std::mutex mutex_;
  Localizer localizer_;
  std::int64_t frames_ = 0;
  FrameTimes times_;
};

std::unique_ptr<MapLocalizer> make_localizer(std::shared_ptr<Sensor> sensor, const PythonMap& map,
                                             const py::object& progress) {
  PythonProgress sink(progress);
  const WithoutGil release;
  return std::make_unique<MapLocalizer>(std::move(sensor), map, sink);
}

void add_map(py::module_& module) {
  py::class_<PythonMap> map(module, "Map", kOwnNew,
                            R"(Surfaces at known poses, in which a Localizer finds the sensor.

path: a run folder, or a folder that `gelslam map` or save() made. The map's frame is the run's, or
the mesh's.)");
  map.def(py::init(&open_map), py::arg("path"))
      .def("__len__", [](const PythonMap& self) { return self.patches.size(); })
      .def_property_readonly("poses", &poses_of_map,
                             "Nx4x4 float64: map_T_sensor of its surfaces, translation in meters.")
      .def("save", &save_map_of_mesh, py::arg("path"), py::kw_only(), py::arg("overwrite") = false,
           "Writes the folder that `gelslam map` writes; of a map that from_mesh() made.")
      .def("__repr__", [](const PythonMap& self) {
        return "<gelslam.Map of " + std::to_string(self.patches.size()) + " surfaces>";
      });
#ifdef GELSLAM_BUILD_SIMULATION
  map.def_static(
      "from_mesh", &map_of_mesh, py::arg("path"), py::kw_only(), py::arg("unit") = "",
      py::arg("config") = py::none(), py::arg("indentation_mm") = MeshMapOptions{}.indentation_mm,
      py::arg("touches") = MeshMapOptions{}.max_touches, py::arg("progress") = false,
      R"(Makes a Map of an object that was never touched, as `gelslam map` does, by simulated touches.

path: a closed mesh (.stl, .obj, .ply). unit: "mm", "cm", "in" or "m", of a file that notes none; default: mm for STL and
OBJ, m for PLY. config: the sensor's picture size and pixel pitch; default: GelSight Mini. indentation_mm: how deep the
sensor will be pressed on. touches: at most. What they do not cover is given as a warning. progress: as of
reconstruct().)");
#endif
}

void add_place(py::module_& module) {
  py::class_<PlaceHypothesis>(module, "Place", kOwnNew, "A place in a map where the sensor may be.")
      .def_property_readonly("map_T_sensor", &pose_of_place, "4x4: sensor to map, translation in meters.")
      .def_readonly("probability", &PlaceHypothesis::probability,
                    "0..1; what is missing to 1 in sum: elsewhere, or not in the map.")
      .def_property_readonly("covariance", &covariance_of_place,
                             "6x6: of `noise` in true = map_T_sensor * exp(noise): x, y, z, rx, ry, rz, "
                             "along the sensor's axes; meters and radians.")
      .def_property_readonly("sigma_mm", &sigma_mm_of_place,
                             "3: one standard deviation along the sensor's x, y, z, mm.")
      .def_property_readonly("sigma_rad", &sigma_rad_of_place, "3: the same about x, y, z, rad.")
      .def("__repr__", [](const PlaceHypothesis& self) {
        return "<gelslam.Place, probability " + std::to_string(self.probability) + ">";
      });
}

void add_located_frame(py::module_& module) {
  py::class_<LocatedFrame>(module, "LocatedFrame", kOwnNew, "What is known of a frame's place in a Map.")
      .def_property_readonly(
          "status", [](const LocatedFrame& self) { return std::string(status_name(self.report)); },
          "\"localized\": one place is certain; \"ambiguous\": several are possible; \"not in the "
          "map\"; or \"no_contact\".")
      .def_property_readonly("map_T_sensor", &of_certain<&pose_of_place>,
                             "4x4: sensor to map, translation in meters; None unless localized.")
      .def_property_readonly("covariance", &of_certain<&covariance_of_place>, "As of a Place; or None.")
      .def_property_readonly("sigma_mm", &of_certain<&sigma_mm_of_place>, "As of a Place; or None.")
      .def_property_readonly("sigma_rad", &of_certain<&sigma_rad_of_place>, "As of a Place; or None.")
      .def_property_readonly(
          "places", &LocatedFrame::places,
          "list of Place: where the sensor may be, the most probable first. Localized: one is certain.")
      .def_property_readonly(
          "reason", [](const LocatedFrame& self) { return self.report.localization->reason; },
          "Why no place is certain, or \"\".")
      .def_readonly(
          "tracked", &LocatedFrame::report,
          "The TrackedFrame: the pose within the trial, without the map; which motions are observable.")
      .def("__repr__", [](const LocatedFrame& self) {
        return "<gelslam.LocatedFrame " + std::to_string(self.report.tracked.frame) + ", " +
               std::string(status_name(self.report)) + ">";
      });
}

void add_localizer(py::module_& module) {
  py::class_<MapLocalizer>(module, "Localizer", kOwnNew,
                           R"(Finds the sensor in a Map, as `gelslam track --map` does.

The pose is that in the map, from the first touch on. sensor: of the map's pixel pitch; its configuration may be that of
the map's run (config.yaml in its folder). progress: as of reconstruct(). Threads that call it wait for each other.)")
      .def(py::init(&make_localizer), py::arg("sensor").none(false), py::arg("map"), py::kw_only(),
           py::arg("progress") = false)
      .def(
          "process",
          [](MapLocalizer& self, const TouchedSurface& surface, double time_s) {
            return self.process(surface.maps, time_s);
          },
          py::arg("surface"), py::arg("time_s"), py::call_guard<WithoutGil>(),
          "Locates a Surface that was taken at time_s (seconds, growing). Returns a LocatedFrame.")
      .def(
          "process",
          [](MapLocalizer& self, const py::object& image, double time_s) {
            const Picture picture = picture_of(image, "image");
            const WithoutGil release;
            return self.process(picture.bgr, time_s);
          },
          py::arg("image"), py::arg("time_s"), "The same for a picture (HxWx3 uint8, BGR).");
}

}  // namespace

void bind_localization(py::module_& module) {
  add_map(module);
  add_place(module);
  add_located_frame(module);
  add_localizer(module);
}

}  // namespace gelslam::python
