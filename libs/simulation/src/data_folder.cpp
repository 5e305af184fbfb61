#include "gelslam/simulation/data_folder.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "data_files.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

using namespace simulation::detail;

constexpr double kMetersPerMm = 1e-3;

struct Encoded {
  SimulatedFrame frame;
  std::vector<std::uint8_t> picture;
};

/// Renders and encodes a frame, and writes its true contact into `folder`.
Encoded encode(const Simulator& simulator, int index, const std::filesystem::path& folder) {
  Encoded encoded{simulator.frame(index), {}};
  encoded.picture = encode_jpeg(encoded.frame.bgr);
  if (index >= simulator.spec().background_frames)
    write_png(contact_file(folder, index), encoded.frame.contact);
  return encoded;
}

/// Determines which vertices of the object's surface were touched by the gel.
class TouchedPoints {
 public:
  explicit TouchedPoints(const Simulator& simulator)
      : simulator_(simulator), touched_(simulator.surface().vertices_mm.size(), false) {}

  void add(const SimulatedFrame& frame) {
    const SensorGeometry& geometry = simulator_.spec().geometry;
    const Eigen::Matrix3f turn = frame.sensor_T_object.linear().cast<float>();
    const Eigen::Vector3f move = frame.sensor_T_object.translation().cast<float>();
    const auto per_mm = static_cast<float>(1 / geometry.pixel_pitch_mm);
    // A vertex may be half a pixel's diagonal away from the pixel's center, which on a slope of up to about
    // 50 degrees changes its height by this much.
    const auto same_sheet_mm = static_cast<float>(geometry.pixel_pitch_mm);
    const auto& vertices = simulator_.surface().vertices_mm;
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      if (touched_[k]) continue;
      const float z = turn.row(2).dot(vertices[k]) + move.z();
      if (z > 0) continue;
      const float u =
          (turn.row(0).dot(vertices[k]) + move.x()) * per_mm + 0.5F * static_cast<float>(geometry.width_px);
      const float v =
          (turn.row(1).dot(vertices[k]) + move.y()) * per_mm + 0.5F * static_cast<float>(geometry.height_px);
      if (!(u >= 0 && v >= 0 && u < static_cast<float>(geometry.width_px) &&
            v < static_cast<float>(geometry.height_px)))
        continue;
      const int column = static_cast<int>(u), row = static_cast<int>(v);
      if (frame.contact(row, column) != 0 && std::abs(z - frame.height_mm(row, column)) < same_sheet_mm)
        touched_[k] = true;
    }
  }

  /// Returns the coordinates x y z of all touched vertices one after another (object frame, meters), in the
  /// order of the vertices.
  std::vector<float> points_m() const {
    std::vector<float> points;
    const auto& vertices = simulator_.surface().vertices_mm;
    for (std::size_t k = 0; k < vertices.size(); ++k)
      if (touched_[k])
        for (int axis = 0; axis < 3; ++axis) points.push_back(vertices[k][axis] * 1e-3F);
    return points;
  }

 private:
  const Simulator& simulator_;
  std::vector<bool> touched_;
};

using RowMajorMatrix = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

RowMajorMatrix in_meters(const Pose& pose) {
  RowMajorMatrix matrix = pose.matrix();
  matrix.topRightCorner<3, 1>() *= kMetersPerMm;
  return matrix;
}

std::string meta_json(const std::string& name, const Simulator& simulator, std::size_t touched_points) {
  const ScanSpec& spec = simulator.spec();
  nlohmann::ordered_json meta;
  meta["name"] = name;
  meta["object"] = spec.object.name;
  meta["motion"] = spec.motion.name;
  meta["frames"] = simulator.frame_count();
  meta["background_frames"] = spec.background_frames;
  meta["fps"] = spec.motion.frame_rate_hz;
  meta["contact_start_frame"] = simulator.contact_start_frame();
  meta["noise_gain"] = spec.optics.noise_gain;
  meta["dirt"] = spec.optics.dirt;
  meta["chroma"] = "yuvj444p";
  const RowMajorMatrix start = in_meters(simulator.start_T_object());
  for (int row = 0; row < 4; ++row)
    meta["start_T_object"].push_back({start(row, 0), start(row, 1), start(row, 2), start(row, 3)});
  meta["gt_mesh"] = {simulator.surface().vertices_mm.size(), simulator.surface().triangles.size()};
  meta["touched_points"] = touched_points;
  meta["object_size"] = spec.object.size;
  meta["object_texture"] = spec.object.texture;
  meta["seeds"] = {{"object", spec.object.seed}, {"motion", spec.motion.seed}, {"sensor", spec.optics.seed}};
  return meta.dump(1) + "\n";
}

}  // namespace

std::filesystem::path contact_file(const std::filesystem::path& folder, std::int64_t frame) {
  return folder / "contact" / fmt::format("{:06}.png", frame);
}

void write_data_folder(const std::filesystem::path& folder, const Simulator& simulator,
                       const DataFolderOptions& options, ProgressSink& progress) {
  std::filesystem::create_directories(contact_file(folder, 0).parent_path());
  const int threads = options.threads > 0
                          ? options.threads
                          : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const SensorGeometry& geometry = simulator.spec().geometry;
  AviWriter video(folder / "gelsight.avi", geometry.width_px, geometry.height_px,
                  simulator.spec().motion.frame_rate_hz);
  std::vector<double> poses;  // N x 4 x 4
  TouchedPoints touched(simulator);
  progress.begin("simulating", simulator.frame_count());
  for (int first = 0; first < simulator.frame_count(); first += threads) {
    std::vector<Encoded> group(static_cast<std::size_t>(std::min(threads, simulator.frame_count() - first)));
    parallel_for(group.size(), threads,
                 [&](std::size_t k) { group[k] = encode(simulator, first + static_cast<int>(k), folder); });
    for (const Encoded& encoded : group) {
      video.add(encoded.picture);
      if (encoded.frame.index >= simulator.spec().background_frames) {
        RowMajorMatrix pose = RowMajorMatrix::Constant(std::numeric_limits<double>::quiet_NaN());
        if (encoded.frame.start_T_sensor) pose = in_meters(*encoded.frame.start_T_sensor);
        poses.insert(poses.end(), pose.data(), pose.data() + pose.size());
        touched.add(encoded.frame);
      }
      progress.update(encoded.frame.index + 1);
    }
  }
  progress.end();
  const std::vector<float> points = touched.points_m();
  if (points.empty())
    throw Error(
        "the sensor touched no outside of the object's surface; if it is a mesh, its triangles may be inside "
        "out");
  write_npy(folder / "touched.npy", {points.size() / 3, 3}, points);
  write_npy(folder / "true_start_T_currs.npy", {poses.size() / 16, 4, 4}, poses);
  write_mesh(folder / "gt_mesh.ply", simulator.surface(), LengthUnit::meter);
  write_file_atomically(
      folder / "config.yaml",
      config_yaml(folder, simulator.spec().geometry, simulator.spec().motion.frame_rate_hz, options.model));
  write_optics(folder / kOpticsFileName, simulator.spec().geometry.optics);
  const std::string name = options.name.empty() ? name_of(std::filesystem::absolute(folder)) : options.name;
  write_file_atomically(folder / "meta.json", meta_json(name, simulator, points.size() / 3));
  video.finish();  // Done last, so that a folder that contains gelsight.avi is complete.
}

}  // namespace gelslam
