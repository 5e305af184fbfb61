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
  MeshMetrics refined;  ///< after rigid ICP
  Refinement refinement;
  bool touched_only = false;  ///< completeness over touched points, not over the whole true surface
  double area_mm2 = 0;        ///< of what it is over

  // Shares, after ICP: of that area, how much is in the mesh; of the mesh, how much lies away from the
  // object.
  double in_mesh() const { return refined.within.back().completeness; }
  double not_object() const { return 1 - refined.within.back().precision; }
};

struct Evaluation {
  std::optional<TrajectoryMetrics> trajectory;
  std::optional<int> reference_frame;        ///< log frame at which estimate and truth are set to identity
  std::optional<double> reference_s;         ///< the same for a truth that was matched by time
  std::optional<std::int64_t> anchor_frame;  ///< as the run says
  std::optional<int> trials;
  std::optional<int> components;
  std::optional<MeshEvaluation> mesh;
  std::string trajectory_warning;  ///< why the true poses may be in another unit or notation, or ""

  /// That, or why the truth may be that of another object, or "".
  std::string warning() const;
};

/// Where a run's mesh lies on the true object, with both meshes in the object's frame.
struct PlacedMeshes {
  Mesh estimate;
  Mesh truth;
};

/// A run beside its truth, time stamps matched to frames.
struct Comparison {
  GroundTruth truth;
  RunFiles run;
  std::vector<IndexedPose> estimate;
  int reference_index = 0;  ///< the frame that places the map on the truth: the anchor
  Pose start_T_map = Pose::Identity();
};

/// Reads both and matches them. Throws Error when they do not belong together: time stamps that are no frames
/// of the log, more frames than the truth has, a log of another length, or no frame that both know. A file in
/// the place of the data folder is a trajectory (TUM) of the sensor by another system, in any fixed frame,
/// with times as the run's; it is interpolated.
Comparison compare(const std::filesystem::path& run, const std::filesystem::path& data_folder);

/// Both meshes in the object's frame, placed by the known pose; none where one of them is missing.
std::optional<PlacedMeshes> place_meshes(const Comparison& comparison);

/// The trajectory, and the meshes where given (then completeness is over comparison.truth.touched_mm if any).
/// `progress`, if given, receives the steps.
Evaluation evaluate(const Comparison& comparison, const std::optional<PlacedMeshes>& meshes,
                    ProgressSink* progress = nullptr);

/// Two bare meshes in one frame; completeness over the whole true surface.
Evaluation evaluate(const PlacedMeshes& meshes, ProgressSink* progress = nullptr);

/// For people, and for programs (one JSON object, pretty-printed, newline at the end).
std::string to_table(const Evaluation& evaluation);
std::string to_json(const Evaluation& evaluation);

}  // namespace gelslam
