#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "gelslam/evaluation/evaluation.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

std::string trajectory_table(const Evaluation& evaluation) {
  const TrajectoryMetrics& t = *evaluation.trajectory;
  std::string text =
      evaluation.reference_s
          ? fmt::format(
                "Trajectory, relative to the pose at {:.6f} s (of the true one as the sensor's own)\n",
                *evaluation.reference_s)
          : fmt::format("Trajectory, relative to frame {}\n", *evaluation.reference_frame);
  text += fmt::format(
      "  ATE (RMSE)              {:.4f} mm, {:.4f} mm after alignment\n"
      "  rotation (RMSE)         {:.3f} deg\n"
      "  mean absolute error     x {:.4f}  y {:.4f}  z {:.4f} mm\n"
      "                          rx {:.3f}  ry {:.3f}  rz {:.3f} deg\n"
      "  geometric mean of six   {:.4f} mm (1 deg = {:.3f} mm)\n"
      "  RPE over 1 frame        {:.4f} mm  {:.4f} deg ({} pairs)\n"
      "  RPE over 1 s            {:.4f} mm  {:.4f} deg ({} pairs)\n"
      "  at the last frame       {:.4f} mm  {:.3f} deg\n",
      t.ate_mm, t.ate_aligned_mm, t.rotation_rmse_deg, t.mae_mm.x(), t.mae_mm.y(), t.mae_mm.z(),
      t.mae_deg.x(), t.mae_deg.y(), t.mae_deg.z(), t.geometric_mean_mm, kMillimetersPerDegree,
      t.over_one_frame.translation_mm, t.over_one_frame.rotation_deg, t.over_one_frame.pairs,
      t.over_one_second.translation_mm, t.over_one_second.rotation_deg, t.over_one_second.pairs, t.final_mm,
      t.final_deg);
  if (evaluation.reference_s)
    return text + fmt::format("  compared                {} of {} poses\n", t.compared_frames,
                              t.compared_frames + t.estimated_without_touch);
  text += fmt::format("  touched frames tracked  {} of {} ({:.1f} %)\n", t.compared_frames, t.touched_frames,
                      100.0 * t.tracked_share());
  if (t.estimated_without_touch > 0) {
    text += fmt::format("  tracked without touch   {} frames (not judged)\n", t.estimated_without_touch);
  }
  if (evaluation.trials) text += fmt::format("  trials                  {}\n", *evaluation.trials);
  if (evaluation.components) text += fmt::format("  components              {}\n", *evaluation.components);
  return text;
}

std::string mesh_rows(const std::string& title, const MeshMetrics& m) {
  std::string text = fmt::format(
      "  {}\n"
      "    accuracy              mean {:.4f}  median {:.4f}  p90 {:.4f} mm\n"
      "    completeness          mean {:.4f}  median {:.4f}  p90 {:.4f} mm\n",
      title, m.accuracy.mean_mm, m.accuracy.median_mm, m.accuracy.p90_mm, m.completeness.mean_mm,
      m.completeness.median_mm, m.completeness.p90_mm);
  for (const ShareWithin& w : m.within)
    text += fmt::format("    within {:.2f} mm        precision {:.3f}  completeness {:.3f}  F {:.3f}\n",
                        w.distance_mm, w.precision, w.completeness, w.f_score);
  return text;
}

std::string mesh_table(const MeshEvaluation& mesh) {
  const MeshMetrics& refined = mesh.refined;
  const std::string level = fmt::format("{:.2f} mm", refined.within.back().distance_mm);
  std::string text = fmt::format(
      "Mesh against the true surface, after alignment\n"
      "  {}         {:.2f} cm², {:.3f} of it in the mesh (within {})\n"
      "  accuracy                mean {:.4f}  p95 {:.4f} mm\n"
      "  in mesh, not touched    {:.4f} of its area (farther than {} from the object)\n",
      mesh.touched_only ? "touched surface" : "whole surface  ", 0.01 * mesh.area_mm2, mesh.in_mesh(), level,
      refined.accuracy.mean_mm, refined.accuracy.p95_mm, mesh.not_object(), level);
  text += mesh_rows("at the known pose", mesh.at_known_pose);
  text += mesh_rows(fmt::format("after rigid ICP (moved {:.4f} mm, {:.3f} deg)", mesh.refinement.shift_mm,
                                mesh.refinement.rotation_deg),
                    mesh.refined);
  return text;
}

Json to_json(const RelativePoseError& e) {
  return {{"pairs", e.pairs}, {"translation_mm", e.translation_mm}, {"rotation_deg", e.rotation_deg}};
}

Json to_json(const TrajectoryMetrics& t) {
  return {{"mae",
           {{"x_mm", t.mae_mm.x()},
            {"y_mm", t.mae_mm.y()},
            {"z_mm", t.mae_mm.z()},
            {"rx_deg", t.mae_deg.x()},
            {"ry_deg", t.mae_deg.y()},
            {"rz_deg", t.mae_deg.z()}}},
          {"geometric_mean_mm", t.geometric_mean_mm},
          {"ate_mm", t.ate_mm},
          {"ate_aligned_mm", t.ate_aligned_mm},
          {"rotation_rmse_deg", t.rotation_rmse_deg},
          {"rpe_1_frame", to_json(t.over_one_frame)},
          {"rpe_1_s", to_json(t.over_one_second)},
          {"final_drift_mm", t.final_mm},
          {"final_drift_deg", t.final_deg},
          {"touched_frames", t.touched_frames},
          {"compared_frames", t.compared_frames},
          {"estimated_without_touch", t.estimated_without_touch},
          {"tracked_share", t.tracked_share()}};
}

Json to_json(const DistanceSummary& d) {
  return {{"mean_mm", d.mean_mm}, {"median_mm", d.median_mm}, {"p90_mm", d.p90_mm}, {"p95_mm", d.p95_mm}};
}

Json to_json(const MeshMetrics& m) {
  Json within = Json::array();
  for (const ShareWithin& w : m.within) {
    within.push_back({{"distance_mm", w.distance_mm},
                      {"precision", w.precision},
                      {"completeness", w.completeness},
                      {"f_score", w.f_score}});
  }
  return {{"accuracy", to_json(m.accuracy)},
          {"completeness", to_json(m.completeness)},
          {"normals_deg", m.normals_deg},
          {"within", within}};
}

Json to_json(const MeshEvaluation& mesh) {
  return {{"completeness_over", mesh.touched_only ? "touched points" : "whole surface"},
          {"area_cm2", 0.01 * mesh.area_mm2},
          {"in_mesh", mesh.in_mesh()},
          {"not_touched", mesh.not_object()},
          {"known_pose", to_json(mesh.at_known_pose)},
          {"after_icp", to_json(mesh.refined)},
          {"icp_shift_mm", mesh.refinement.shift_mm},
          {"icp_rotation_deg", mesh.refinement.rotation_deg}};
}

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

}  // namespace

std::string to_table(const Evaluation& evaluation) {
  std::string text;
  if (evaluation.trajectory) text += trajectory_table(evaluation);
  if (evaluation.mesh) text += mesh_table(*evaluation.mesh);
  return text;
}

std::string to_json(const Evaluation& evaluation) {
  Json json;
  json["trajectory"] = evaluation.trajectory ? to_json(*evaluation.trajectory) : Json(nullptr);
  json["reference_frame"] = or_null(evaluation.reference_frame);
  json["reference_s"] = or_null(evaluation.reference_s);
  json["anchor_frame"] = or_null(evaluation.anchor_frame);
  json["trials"] = or_null(evaluation.trials);
  json["components"] = or_null(evaluation.components);
  json["mesh"] = evaluation.mesh ? to_json(*evaluation.mesh) : Json(nullptr);
  return json.dump(2) + "\n";
}

}  // namespace gelslam
