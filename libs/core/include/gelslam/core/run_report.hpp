#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/sensor_optics.hpp"
#include "gelslam/core/stage_timer.hpp"

namespace gelslam {

/// Statistics of a run, under the names that they have in report.json (docs/file-formats.md).
struct RunReport {
  struct Optics : SensorOptics {
    std::string from;
  };
  struct Log {
    std::string file;         ///< Current or original path of the log; empty if none was kept.
    double first_time_s = 0;  ///< Time of its first image in the run's trajectory.
  };
  struct Frames {
    std::int64_t total = 0, background = 0, no_contact = 0, tracked = 0, lost = 0;
    std::int64_t in_map = 0;
    /// Frames that were tracked, but belong to another component, or whose pose in the map is not determined.
    std::int64_t not_in_mesh = 0;
    std::int64_t left_out = 0;  ///< Damaged or dropped frames.
  };
  /// Uncertainty of the poses in the map in their worst direction: the 95 % quantile over all poses.
  struct Drift {
    double amount = 0;  ///< two standard deviations, mm or degrees (at most 180)
    std::int64_t frame = -1;
    double time_s = 0;
  };
  /// A motion of the sensor that was not observable for a while.
  struct UnobservableMotion {
    std::string motion;            ///< First frame in which it was not observable.
    std::int64_t first_frame = 0;  ///< in which it was not
    double first_time_s = 0;
    std::int64_t frames = 0;  ///< Number of frames in which it was not observable.
  };
  struct Uncertainty {
    Drift drift_mm, drift_deg;
    std::vector<UnobservableMotion> not_observable;
  };
  struct GradientScale {
    double x = 1, y = 1;
  };
  struct MeshSize {
    std::size_t vertices = 0, triangles = 0;
    std::int64_t islands_left_out = 0;  ///< Small islands, and islands that only a single keyframe shows.
  };
  /// Area of the object's surface that keyframes show; each place counts once. Parts that are joined but not
  /// in the mesh are shown only by the uncertain rims of contacts, or are islands.
  struct Touched {
    double area_cm2 = 0;  ///< 0 if not known.
    double in_mesh_cm2 = 0;
    double not_joined_cm2 = 0;  ///< Area shown outside the map; it may overlap places of the map.
  };
  using Stage = StageStatistics;
  struct Live {
    double rate_hz = 0;
    std::int64_t arrived = 0, lost_by_camera = 0, dropped = 0, damaged = 0;
  };

  std::string program, log, log_description, model;
  Optics optics;
  bool partial = false;       ///< True if the run was stopped before the end of the log.
  std::optional<bool> saved;  ///< False for a live scan of which nothing was saved yet.
  /// Microseconds since 1970 at the log's first image. If empty, the trajectory's times count from that
  /// image.
  std::optional<std::int64_t> start_unix_us;
  std::vector<std::string> warnings;  ///< Problems of the log, as sentences for the user.
  /// What is not in the mesh, or uncertain, as sentences for the user.
  std::vector<std::string> result_warnings;
  std::vector<std::string> parts;  ///< For a scan of several parts: what became of each part.
  std::vector<Log> logs;           ///< Logs of these parts.
  std::int64_t anchor_frame = -1;  ///< -1 if nothing was touched.
  Frames frames;
  Uncertainty uncertainty;
  int keyframes = 0, trials = 0, components = 0, loops = 0, loop_outliers = 0;
  GradientScale gradient_scale;
  MeshSize mesh;
  Touched touched;
  double seconds = 0;
  std::optional<Live> live;
  std::map<std::string, StageStatistics> stages;  ///< by name

  /// True if everything that was tracked is in the mesh.
  bool complete() const { return components < 2 && frames.not_in_mesh == 0; }
  /// True if there is a mesh, and most frames with contact were tracked.
  bool good() const { return mesh.triangles > 0 && frames.lost <= frames.tracked; }
};

/// Returns "3.2 cm² touched, 90 % of it in the mesh; 8 % not joined, 2 % only at rims of contacts, or in
/// islands", or "" if the area is not known.
std::string describe(const RunReport::Touched& touched);

/// Returns the report as JSON. Bytes that are not UTF-8 (in file names) are replaced.
std::string report_json(const RunReport& report);
/// Reads a report; unknown members are ignored. Throws Error that names `file` for anything else.
RunReport parse_report(const std::string& json, const std::filesystem::path& file);
/// Returns the report of a run folder, or nothing if it has no report.json. Throws Error when it is damaged.
std::optional<RunReport> find_report(const std::filesystem::path& run_folder);

}  // namespace gelslam
