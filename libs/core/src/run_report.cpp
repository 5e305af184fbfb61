#include "gelslam/core/run_report.hpp"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Optics, from, lens_k1, lens_center_px, pixel_aspect,
                                   camera_distance_mm, gel_dome_per_mm)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Log, file, first_time_s)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Frames, total, background, no_contact, tracked, lost, in_map,
                                   not_in_mesh, left_out)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Drift, amount, frame, time_s)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::UnobservableMotion, motion, first_frame, first_time_s, frames)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Uncertainty, drift_mm, drift_deg, not_observable)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::GradientScale, x, y)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::MeshSize, vertices, triangles, islands_left_out)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Touched, area_cm2, in_mesh_cm2, not_joined_cm2)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Live, rate_hz, arrived, lost_by_camera, dropped, damaged)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport::Stage, count, median_ms, p99_ms, max_ms, total_ms)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunReport, program, log, log_description, model, optics, partial, warnings,
                                   result_warnings, parts, logs, anchor_frame, frames, uncertainty, keyframes,
                                   trials, components, loops, loop_outliers, gradient_scale, mesh, touched,
                                   seconds, stages)

namespace {

using Json = nlohmann::json;

template <typename T>
void write_optional(Json& json, const char* key, const std::optional<T>& value) {
  if (value) json[key] = *value;
}

template <typename T>
void read_optional(const Json& json, const char* key, std::optional<T>& value) {
  if (json.contains(key)) json[key].get_to(value.emplace(T{}));
}

/// Returns the name of a member that is missing or has another type than in `model`, such as "frames.total";
/// or "".
std::string wrong_member(const Json& json, const Json& model) {
  for (const auto& [key, value] : model.items()) {
    if (!json.contains(key)) return key;
    const Json& member = json[key];
    if (member.is_number() != value.is_number() || (!value.is_number() && member.type() != value.type()))
      return key;
    const std::string within = value.is_object() ? wrong_member(member, value) : "";
    if (!within.empty()) return fmt::format("{}.{}", key, within);
  }
  return "";
}

}  // namespace

std::string describe(const RunReport::Touched& touched) {
  if (!(touched.area_cm2 > 0)) return "";
  const auto percent = [&](double part_cm2) { return std::lround(100 * part_cm2 / touched.area_cm2); };
  const long in_mesh = percent(touched.in_mesh_cm2), not_joined = percent(touched.not_joined_cm2),
             rim = 100 - in_mesh - not_joined;
  std::string text =
      fmt::format("{} cm² touched, {} % of it in the mesh", short_number(touched.area_cm2, 2), in_mesh);
  if (not_joined > 0) text += fmt::format("; {} % not joined", not_joined);
  if (rim > 0)
    text += fmt::format("{} {} % only at rims of contacts, or in islands", not_joined > 0 ? "," : ";", rim);
  return text;
}

std::string report_json(const RunReport& report) {
  Json json = report;
  write_optional(json, "saved", report.saved);
  write_optional(json, "live", report.live);
  write_optional(json, "start_unix_us", report.start_unix_us);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

RunReport parse_report(const std::string& text, const std::filesystem::path& file) {
  const std::string damaged = file.string() + ": is damaged, or not the report of a run";
  Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) throw Error(damaged);
  if (json.contains("mesh") && json["mesh"].is_object())
    json["mesh"].emplace("islands_left_out", 0);  // Reports of older versions do not contain it.
  json.emplace("touched", RunReport::Touched{});  // Neither do they contain this.
  // Its name in older versions.
  if (json.contains("reservations")) json.emplace("result_warnings", json["reservations"]);
  if (const std::string member = wrong_member(json, RunReport()); !member.empty())
    throw Error(damaged + ": " + member + " is missing or not as it should be");
  try {
    auto report = json.get<RunReport>();
    read_optional(json, "saved", report.saved);
    read_optional(json, "live", report.live);
    read_optional(json, "start_unix_us", report.start_unix_us);
    return report;
  } catch (const Json::exception&) {
    throw Error(damaged);
  }
}

std::optional<RunReport> find_report(const std::filesystem::path& run_folder) {
  const std::filesystem::path file = run_folder / "report.json";
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return std::nullopt;
  return parse_report(read_file(file), file);
}

}  // namespace gelslam
