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

/// The figures of a run, as report.json holds them under these names (docs/file-formats.md).
struct RunReport {
  struct Optics : SensorOptics {
    std::string from;
  };
  struct Log {
    std::string file;         ///< where it is, or was when the run was made; empty: none was kept
    double first_time_s = 0;  ///< of its first picture, in the run's trajectory
  };
  struct Frames {
    std::int64_t total = 0, background = 0, no_contact = 0, tracked = 0, lost = 0;
    std::int64_t in_map = 0;
    std::int64_t not_in_mesh = 0;  ///< tracked, but in another component, or at a place that is not known
    std::int64_t left_out = 0;     ///< damaged or dropped
  };
  /// Of poses in the map, in their worst direction: one in twenty is known worse.
  struct Drift {
    double amount = 0;  ///< two standard deviations, mm or degrees (at most 180)
    std::int64_t frame = -1;
    double time_s = 0;
  };
  /// A motion of the sensor that was not observable for a while.
  struct UnobservableMotion {
    std::string motion;            ///< x, y, z, rx, ry, rz
    std::int64_t first_frame = 0;  ///< in which it was not
    double first_time_s = 0;
    std::int64_t frames = 0;  ///< in which it was not
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
    std::int64_t islands_left_out = 0;  ///< small pieces, or such that a single keyframe shows
  };
  /// Surface of the object that keyframes show, each place once. What is joined and not in the mesh is shown
  /// only by the uncertain rim of contacts, or is an island.
  struct Touched {
    double area_cm2 = 0;  ///< 0: not known
    double in_mesh_cm2 = 0;
    double not_joined_cm2 = 0;  ///< outside the map; it may show places of the map again
  };
  using Stage = StageStatistics;
  struct Live {
    double rate_hz = 0;
    std::int64_t arrived = 0, lost_by_camera = 0, dropped = 0, damaged = 0;
  };

  std::string program, log, log_description, model;
  Optics optics;
  bool partial = false;       ///< stopped before the log's end
  std::optional<bool> saved;  ///< false: a live scan of which nothing was saved yet
  /// Microseconds since 1970 at the log's first picture; none: the trajectory's times count from there.
  std::optional<std::int64_t> start_unix_us;
  std::vector<std::string> warnings;         ///< what was not right with the log, for people
  std::vector<std::string> result_warnings;  ///< what is not in the mesh, or uncertain
  std::vector<std::string> parts;            ///< of a scan in parts: what became of each
  std::vector<Log> logs;                     ///< the same parts'
  std::int64_t anchor_frame = -1;            ///< -1: nothing touched
  Frames frames;
  Uncertainty uncertainty;
  int keyframes = 0, trials = 0, components = 0, loops = 0, loop_outliers = 0;
  GradientScale gradient_scale;
  MeshSize mesh;
  Touched touched;
  double seconds = 0;
  std::optional<Live> live;
  std::map<std::string, StageStatistics> stages;  ///< by name

  /// All that was tracked is in the mesh: no component is left, nor a frame.
  bool complete() const { return components < 2 && frames.not_in_mesh == 0; }
  /// There is a mesh, and most of what touched was tracked.
  bool good() const { return mesh.triangles > 0 && frames.lost <= frames.tracked; }
};

/// "3.2 cm² touched, 90 % of it in the mesh; 8 % not joined, 2 % only at rims of contacts, or in islands"; or
/// "" where it is not known.
std::string describe(const RunReport::Touched& touched);

/// What is not UTF-8 (of file names) is replaced.
std::string report_json(const RunReport& report);
/// Members of other names are passed over. Throws Error, naming `file`, for what is no report.
RunReport parse_report(const std::string& json, const std::filesystem::path& file);
/// The report of a run folder; none where it has no report.json. Throws Error when that is damaged.
std::optional<RunReport> find_report(const std::filesystem::path& run_folder);

}  // namespace gelslam
