#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"

namespace gelslam {

struct MeshEvaluation {
  MeshMetrics at_known_pose;
  MeshMetrics refined;  ///< After rigid ICP.
  Refinement refinement;
  /// True if completeness refers to touched points, and not to the whole true surface.
  bool touched_only = false;
  double area_mm2 = 0;  ///< Area to which completeness refers.

  // Fractions after ICP: how much of that area is in the mesh, and how much of the mesh is not on the object.
  double in_mesh() const { return refined.within.back().completeness; }
  double not_object() const { return 1 - refined.within.back().precision; }
};

struct Evaluation {
  std::optional<TrajectoryMetrics> trajectory;
  std::optional<int> reference_frame;        ///< Log frame at which estimate and truth are aligned.
  std::optional<double> reference_s;         ///< The same as a time, for a truth that was matched by time.
  std::optional<std::int64_t> anchor_frame;  ///< As in the run's report.
  std::optional<int> trials;
  std::optional<int> components;
  std::optional<MeshEvaluation> mesh;
  std::string trajectory_warning;  ///< Why the true poses may be in another unit or notation, or "".

  /// Returns trajectory_warning, or why the truth may be that of another object, or "".
  std::string warning() const;
};

/// The run's mesh and the true mesh, both in the object's frame.
struct PlacedMeshes {
  Mesh estimate;
  Mesh truth;
};

/// A run with its ground truth; time stamps are matched to frames.
struct Comparison {
  GroundTruth truth;
  RunFiles run;
  std::vector<IndexedPose> estimate;
  int reference_index = 0;  ///< Frame at which the map is aligned with the truth: the anchor.
  Pose start_T_map = Pose::Identity();
};

/// Reads a run and its ground truth and matches them. Throws Error when they do not belong together: time
/// stamps that are no frames of the log, more frames than the truth has, a log of another length, or no
/// common frame. If `data_folder` is a file, it is a trajectory (TUM) of the sensor from another system, in
/// any fixed frame and with the same clock as the run; it is interpolated.
Comparison compare(const std::filesystem::path& run, const std::filesystem::path& data_folder);

/// Returns both meshes in the object's frame, aligned by the known pose; nothing if one of them is missing.
std::optional<PlacedMeshes> place_meshes(const Comparison& comparison);

/// Evaluates the trajectory, and the meshes if given; completeness then refers to comparison.truth.touched_mm
/// if that is not empty. `progress`, if given, receives the steps.
Evaluation evaluate(const Comparison& comparison, const std::optional<PlacedMeshes>& meshes,
                    ProgressSink* progress = nullptr);

/// Compares two meshes in one frame; completeness refers to the whole true surface.
Evaluation evaluate(const PlacedMeshes& meshes, ProgressSink* progress = nullptr);

/// Return the result as a table for people, or as one JSON object (pretty-printed, with a newline at the
/// end).
std::string to_table(const Evaluation& evaluation);
std::string to_json(const Evaluation& evaluation);

}  // namespace gelslam
