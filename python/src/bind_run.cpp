#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <variant>

#include "bind.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/surface/slopes.hpp"
#include "run.hpp"
#include "sensor.hpp"

namespace gelslam::python {
namespace {

namespace fs = std::filesystem;

py::array vectors_view(const std::vector<Eigen::Vector3f>& rows, const py::object& owner) {
  return rows_view(rows.empty() ? nullptr : rows.front().data(), rows.size(), 3, owner);
}

/// Converts an array that vectors_view() made.
template <class Number>
std::vector<Eigen::Matrix<Number, 3, 1>> vectors_of(const py::handle& array) {
  const auto rows = py::array_t<Number, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!rows || rows.ndim() != 2 || rows.shape(1) != 3) throw Error("this is no pickled gelslam.Mesh");
  std::vector<Eigen::Matrix<Number, 3, 1>> vectors(static_cast<std::size_t>(rows.shape(0)));
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
    vectors[static_cast<std::size_t>(i)] = {rows.at(i, 0), rows.at(i, 1), rows.at(i, 2)};
  return vectors;
}

std::shared_ptr<MetricMesh> unpickled_mesh(const py::tuple& state) {
  auto mesh = std::make_shared<MetricMesh>(Mesh());
  mesh->vertices_m = vectors_of<float>(state[0]);
  mesh->mesh.normals = vectors_of<float>(state[1]);
  mesh->mesh.triangles = vectors_of<int>(state[2]);
  mesh->mesh.confidence = state[3].cast<std::vector<float>>();
  const auto vertices = static_cast<int>(mesh->vertices_m.size());
  const auto has = [&](const auto& values) { return values.empty() || std::ssize(values) == vertices; };
  const auto exists = [&](const Eigen::Vector3i& t) { return t.minCoeff() >= 0 && t.maxCoeff() < vertices; };
  if (!has(mesh->mesh.normals) || !has(mesh->mesh.confidence) ||
      !std::ranges::all_of(mesh->mesh.triangles, exists))
    throw Error("this is no pickled gelslam.Mesh");
  return mesh;
}

py::object open3d_mesh(const py::object& self) {
  const py::module_ open3d = py::module_::import("open3d");
  const py::object utility = open3d.attr("utility");
  const auto vectors = [&](const char* name) {
    return utility.attr("Vector3dVector")(self.attr(name).attr("astype")("float64"));
  };
  const py::object mesh =
      open3d.attr("geometry")
          .attr("TriangleMesh")(vectors("vertices"), utility.attr("Vector3iVector")(self.attr("triangles")));
  if (py::len(self.attr("normals")) > 0) mesh.attr("vertex_normals") = vectors("normals");
  return mesh;
}

/// The vertices correspond to those of the arrays, as none are merged.
py::object trimesh_mesh(const py::object& self) {
  using namespace py::literals;
  const py::object normals = self.attr("normals");
  return py::module_::import("trimesh").attr("Trimesh")(
      "vertices"_a = self.attr("vertices"), "faces"_a = self.attr("triangles"),
      "vertex_normals"_a = py::len(normals) > 0 ? normals : py::none(), "process"_a = false);
}

const MetricMesh& mesh_of(const py::object& self) { return self.cast<const MetricMesh&>(); }

void add_mesh(py::module_& module) {
  py::class_<MetricMesh, std::shared_ptr<MetricMesh>>(
      module, "Mesh", kOwnNew, "A triangle mesh in the map's frame. The arrays are read-only.")
      .def_property_readonly(
          "vertices", [](const py::object& self) { return vectors_view(mesh_of(self).vertices_m, self); },
          "Nx3 float32, meters.")
      .def_property_readonly(
          "normals", [](const py::object& self) { return vectors_view(mesh_of(self).mesh.normals, self); },
          "Nx3 float32: unit normals out of the object; 0x3 when there are none.")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            const auto& triangles = mesh_of(self).mesh.triangles;
            return rows_view(triangles.empty() ? nullptr : triangles.front().data(), triangles.size(), 3,
                             self);
          },
          "Mx3 int32: indices of vertices, counter-clockwise seen from outside.")
      .def_property_readonly(
          "confidence",
          [](const py::object& self) {
            const std::vector<float>& confidence = mesh_of(self).mesh.confidence;
            return view(py::dtype::of<float>(), {static_cast<py::ssize_t>(confidence.size())},
                        {static_cast<py::ssize_t>(sizeof(float))}, confidence.data(), self);
          },
          "N float32: summed weight of the observations behind a vertex; empty when there is none.")
      .def(
          "save",
          [](const MetricMesh& self, const fs::path& path) {
            const WithoutGil release;
            Mesh mesh = self.mesh;
            for (const Eigen::Vector3f& v : self.vertices_m) mesh.vertices_mm.push_back(v / 1e-3F);
            write_mesh(path, mesh, usual_unit(path));
          },
          py::arg("path"), "Writes .ply or .glb (meters), .obj or .stl (millimeters).")
      .def("to_open3d", &open3d_mesh, "An open3d.geometry.TriangleMesh, meters. Needs open3d.")
      .def("to_trimesh", &trimesh_mesh, "A trimesh.Trimesh, meters. Needs trimesh.")
      .def(py::pickle(
          [](const py::object& self) {
            return py::make_tuple(self.attr("vertices"), self.attr("normals"), self.attr("triangles"),
                                  self.attr("confidence"));
          },
          unpickler("Mesh", &unpickled_mesh)))
      .def("__reduce_ex__", &reduced)
      .def("__repr__", [](const MetricMesh& self) {
        return "<gelslam.Mesh of " + std::to_string(self.vertices_m.size()) + " vertices, " +
               std::to_string(self.mesh.triangles.size()) + " triangles>";
      });
}

std::vector<std::string> warnings_of(const PythonRun& run) {
  std::vector<std::string> warnings = run.report.warnings;
  warnings.insert(warnings.end(), run.report.result_warnings.begin(), run.report.result_warnings.end());
  return warnings;
}

PythonRun read_run(const fs::path& folder) {
  RunFiles files = read_run_files(folder);
  return {.run = nullptr,
          .mesh = std::make_shared<MetricMesh>(read_mesh(folder / "mesh.ply")),
          .trajectory = std::move(files.trajectory),
          .report = std::move(files.report).value_or(RunReport()),
          .folder = folder};
}

void save(const PythonRun& self, const fs::path& folder, bool overwrite) {
  if (!self.run) throw Error("this run was read from " + self.folder.string() + ": copy that folder");
  const WithoutGil release;
  save_run(folder, *self.run, overwrite);
}

/// A keyframe of the map.
struct PythonKeyframe {
  std::int64_t frame = 0;
  double time_s = 0;
  Pose map_T_sensor = Pose::Identity();
  std::optional<Matrix6d>
      /// Covariance of the pose relative to the map's frame; not available for a run from a folder.
      covariance;
  StoredSurface surface;
};

/// Returns the scan from which a run was made.
std::shared_ptr<const ScanRecord> scan_of(const PythonRun& self) {
  if (self.run) return {self.run, &self.run->map};
  return std::make_shared<const ScanRecord>(read_scan(self.folder, {}));
}

std::vector<PythonKeyframe> keyframes_of(const PythonRun& self) {
  const WithoutGil release;
  const std::shared_ptr<const ScanRecord> scan = scan_of(self);
  const MapSnapshot map = self.run ? snapshot_of(self.run->map) : load_saved_map(self.folder);
  const std::vector<PosedSurface> patches = posed_surfaces(map);
  const std::vector<double> stamps = scan->stamps_s();
  std::map<std::int64_t, double> time_of;
  for (std::size_t i = 0; i < stamps.size(); ++i) time_of[scan->frames[i].frame] = stamps[i];
  std::vector<PythonKeyframe> keyframes;
  for (const PosedSurface& patch : patches) {
    const std::int64_t frame = scan->keyframes.at(static_cast<std::size_t>(patch.id))->frame;
    keyframes.push_back({frame, time_of.at(frame), patch.map_T_keyframe, std::nullopt, patch.surface});
    if (self.run) keyframes.back().covariance = map.pose_of({.keyframe = patch.id})->map_T_frame.covariance;
  }
  return keyframes;
}

/// Returns the frame numbers of the poses. They are found by time, because times in a file are rounded.
py::array_t<std::int64_t> frames_of(const PythonRun& self) {
  std::vector<std::int64_t> frames;
  {
    const WithoutGil release;
    const std::shared_ptr<const ScanRecord> scan = scan_of(self);
    const std::vector<double> stamps = scan->stamps_s();
    std::size_t next = 0;
    for (const StampedPose& pose : self.trajectory) {
      const auto distance = [&](std::size_t i) { return std::abs(stamps[i] - pose.time_s); };
      while (next + 1 < stamps.size() && distance(next + 1) <= distance(next)) ++next;
      frames.push_back(scan->frames.at(next).frame);
    }
  }
  return py::array_t<std::int64_t>(static_cast<py::ssize_t>(frames.size()), frames.data());
}

std::optional<py::array_t<double>> covariances_of(const PythonRun& self) {
  const auto known = [](const StampedPose& pose) { return pose.covariance.has_value(); };
  if (!std::ranges::all_of(self.trajectory, known)) return std::nullopt;
  py::array_t<double> array(
      {static_cast<py::ssize_t>(self.trajectory.size()), py::ssize_t{6}, py::ssize_t{6}});
  double* numbers = array.mutable_data();
  for (const StampedPose& pose : self.trajectory)
    numbers = std::ranges::copy(translation_first(*pose.covariance, kMetersPerMm).reshaped(), numbers).out;
  return array;
}

TouchedSurface surface_of(const PythonKeyframe& self) {
  SurfacePtr maps = self.surface.get();
  const double sigma_rad = kBestSlopeSigmaRad * maps->slope_sigma_ratio;
  return {std::move(maps), sigma_rad};
}

void add_keyframe(py::module_& module) {
  py::class_<PythonKeyframe>(module, "Keyframe", kOwnNew, "A frame whose surface is in the map.")
      .def_readonly("frame", &PythonKeyframe::frame, "Number of the frame in the log, from 0.")
      .def_readonly("time_s", &PythonKeyframe::time_s, "Its time, by the clock of Run.times.")
      .def_property_readonly(
          "map_T_sensor", [](const PythonKeyframe& self) { return array_of(self.map_T_sensor); },
          "4x4: sensor to map, translation in meters.")
      .def_property_readonly(
          "covariance",
          [](const PythonKeyframe& self) -> std::optional<py::array_t<double>> {
            if (!self.covariance) return std::nullopt;
            return scaled_array_of(*self.covariance, kMetersPerMm);
          },
          "6x6: of `noise` in true = map_T_sensor * exp(noise), relative to the keyframe that is the map's "
          "frame:\nx, y, z, rx, ry, rz, along the sensor's axes; meters and radians. None of a run that was "
          "read from its folder.")
      .def_property_readonly("surface", &surface_of, "Its Surface.")
      .def("__repr__", [](const PythonKeyframe& self) {
        return "<gelslam.Keyframe, frame " + std::to_string(self.frame) + ">";
      });
}

py::object report_of(const PythonRun& self) {
  return py::module_::import("json").attr("loads")(report_json(self.report));
}

void add_run(py::module_& module) {
  py::class_<PythonRun>(module, "Run", kOwnNew, R"(A reconstruction: surface, trajectory and figures.

The map's frame is that of the sensor at its first full contact: x right, y down, z out of the gel.)")
      .def(py::init(&read_run), py::arg("path"), py::call_guard<WithoutGil>(),
           "Reads the folder of a finished run.")
      .def_readonly("mesh", &PythonRun::mesh, "The surface, a Mesh.")
      .def_property_readonly(
          "trajectory", [](const PythonRun& self) { return poses_of(self.trajectory); },
          "Nx4x4 float64: map_T_sensor of every frame in the map, translation in meters.")
      .def_property_readonly(
          "covariances", &covariances_of,
          "Nx6x6 float64: of `noise` in true = trajectory * exp(noise), relative to the map's frame: x, y, "
          "z, "
          "rx, ry, rz,\nalong the sensor's axes; meters and radians. None of a folder that has none.")
      .def_property_readonly(
          "times", [](const PythonRun& self) { return times_of(self.trajectory); },
          "N float64: when they were taken: Unix time (s) where the log knows it, else seconds since its "
          "first "
          "frame.")
      .def_property_readonly("frames", &frames_of, "N int64: their numbers in the log, from 0.")
      .def_property_readonly("keyframes", &keyframes_of, "list of Keyframe: what the map consists of.")
      .def_property_readonly(
          "folder",
          [](const PythonRun& self) -> std::optional<fs::path> {
            if (self.run) return std::nullopt;
            return self.folder;
          },
          "Where it was read; None of one that was not.")
      .def_property_readonly(
          "report", &report_of,
          "dict: the figures of report.json: frames, keyframes, loops, partial, warnings...")
      .def_property_readonly("warnings", &warnings_of,
                             "list of str: what was wrong with the log or its background, what is not in the "
                             "mesh, how far poses\nmay be off, and what was not observable. The last three "
                             "are also given as Python warnings. Their\nfigures: report[\"uncertainty\"].")
      .def("save", &save, py::arg("path"), py::kw_only(), py::arg("overwrite") = false,
           "Writes a run folder: mesh, trajectory, keyframes, pose graph, configuration, report.")
      .def("__repr__", [](const PythonRun& self) {
        return "<gelslam.Run of " + std::to_string(self.trajectory.size()) + " poses, " +
               std::to_string(self.mesh->vertices_m.size()) + " vertices>";
      });
}

/// Stop function of work that must not end early with a partial result: Ctrl-C raises an exception.
bool stop_by_signal() {
  check_signals();
  return false;
}

PythonRun reconstruct_log(const fs::path& log, const OptionalPath& model, const OptionalPath& background,
                          const OptionalPath& config, bool force, const OptionalPath& continue_from,
                          const std::optional<std::pair<std::int64_t, std::int64_t>>& background_frames,
                          bool cropped, const py::object& progress) {
  if (background_frames &&
      (background_frames->first < 0 || background_frames->second < background_frames->first))
    throw Error("background_frames: give the first and the last frame, as (12, 21)");
  PythonProgress sink(progress);
  PythonRun run;
  {
    const WithoutGil release;
    const fs::path continued = continue_from.value_or("");
    LogInput named{log, config.value_or(""), model.value_or(""), background.value_or(""), force, {}, cropped};
    if (background_frames) named.background_frames = {background_frames->first, background_frames->second};
    const LogInput input = with_settings_of_run(std::move(named), continued);
    run = python_run(reconstruct(
        {.input = input, .config = resolve_config(input), .continued_run = continued}, sink, stop_by_signal));
  }
  warn_of(run);
  return run;
}

/// Fuses one run, or merges several.
PythonRun fuse_runs(const std::variant<fs::path, std::vector<fs::path>>& runs, const OptionalPath& output,
                    std::optional<double> voxel_size_mm, std::optional<double> truncation_mm, bool overwrite,
                    const py::object& progress) {
  PythonProgress sink(progress);
  PythonRun fused;
  {
    const WithoutGil release;
    if (const auto* several = std::get_if<std::vector<fs::path>>(&runs)) {
      if (!output) throw Error("give output: a run folder for the joined runs");
      if (voxel_size_mm || truncation_mm) throw Error("voxel_size_mm and truncation_mm are for one run");
      merge_scans({*several, *output, overwrite}, sink, stop_by_signal);
      fused = read_run(*output);
    } else {
      const fs::path& run = std::get<fs::path>(runs);
      const FuseRequest request{run, output.value_or(""), overwrite, voxel_size_mm, truncation_mm};
      fuse_run(request, sink, stop_by_signal);
      fused = read_run(output.value_or(run));
    }
  }
  warn_of(fused);
  return fused;
}

}  // namespace

MetricMesh::MetricMesh(Mesh mesh_mm) : mesh(std::move(mesh_mm)) {
  vertices_m.reserve(mesh.vertices_mm.size());
  // Rounded as in files.
  for (const Eigen::Vector3f& v : mesh.vertices_mm)
    vertices_m.push_back((v.cast<double>() * kMetersPerMm).cast<float>());
  mesh.vertices_mm = {};
}

PythonRun python_run(Run run) {
  PythonRun result;
  result.mesh = std::make_shared<MetricMesh>(run.mesh);
  result.trajectory = run.map.trajectory();
  result.report = run.report;
  result.run = std::make_shared<const Run>(std::move(run));
  return result;
}

void warn_of(const PythonRun& run) {
  for (const std::string& sentence : run.report.result_warnings) warn(sentence);
}

Config config_of(const OptionalPath& config, const OptionalPath& model) {
  if (!config && !model) throw Error("no gradient model: give model, or config that names one");
  LogInput input;
  input.config = config.value_or("");
  input.model = model.value_or("");
  return resolve_config(input);
}

void bind_run(py::module_& module) {
  add_mesh(module);
  add_keyframe(module);
  add_run(module);
  module.def("reconstruct", &reconstruct_log, py::arg("log"), py::arg("model") = py::none(), py::kw_only(),
             py::arg("background") = py::none(), py::arg("config") = py::none(), py::arg("force") = false,
             py::arg("continue_from") = py::none(), py::arg("background_frames") = py::none(),
             py::arg("cropped") = false, py::arg("progress") = false,
             R"(Turns a log into a Run, as `gelslam reconstruct` does; the same log gives the same result.

log: a video, a folder of pictures, a log of `gelslam record`, or a data folder. model and config: default: those in or
beside the log. background: an image; default: the log's first frames, which must show the bare gel. force: go on
although they seem to show contact. continue_from: a run folder that the log continues: the same object, sensor and
model; it stays as it is, and its configuration counts unless config names one. background_frames: (first, last) of
the log that show the bare gel; earlier ones are left out. cropped: pictures of another size were cropped already.
progress: True for a line on stderr, or a function of (task, done, total or None).
Ctrl-C raises KeyboardInterrupt.)");
  module.def(
      "fuse", &fuse_runs, py::arg("run"), py::arg("output") = py::none(), py::kw_only(),
      py::arg("voxel_size_mm") = py::none(), py::arg("truncation_mm") = py::none(),
      py::arg("overwrite") = false, py::arg("progress") = false,
      R"(Makes a run's mesh again with other settings, without its log, or joins scans of one object by one sensor and model.
Returns the Run with the new mesh.

run: its folder; of a scan that was not finished, the map is made first. A list of run folders: they join where they
show the same places, with the first one's configuration; what did not join is given as a warning. output: a run folder
to write; default, for one run: its own mesh is replaced. voxel_size_mm: edge of the mesh's cells. truncation_mm: sheets of one side closer than this
become one; at least two voxels. Default: the run's. progress: as of reconstruct().)");
  module.def("read_run", &read_run, py::arg("path"), py::call_guard<WithoutGil>(), "Run(path).");
}

}  // namespace gelslam::python
