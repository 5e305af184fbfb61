// Checks, describes, reads and writes the optics of a sensor.

#include "gelslam/core/sensor_optics.hpp"

#include <fmt/core.h>

#include <cmath>

#include "gelslam/core/files.hpp"
#include "gelslam/core/options.hpp"

namespace gelslam {
namespace {

// The limits of the optics. No real lens, camera or gel exceeds them.
constexpr double kMaxK1 = 0.3, kMinDistanceMm = 5, kSteepestDome = 0.5, kMaxAspect = 1.5;

}  // namespace

std::string why_impossible(const SensorOptics& optics, int width_px, int height_px, double pixel_pitch_mm) {
  // Comparisons with NaN are false, so NaN is out of range.
  const auto in = [](double x, double least, double most) { return x >= least && x <= most; };
  const auto [u, v] = optics.lens_center_px;
  const auto [a, b] = optics.gel_dome_per_mm;
  if (!in(optics.lens_k1, -kMaxK1, kMaxK1)) return "lens_k1 must be from -0.3 to 0.3";
  if (!in(u, -0.5 * width_px, 0.5 * width_px) || !in(v, -0.5 * height_px, 0.5 * height_px))
    return "lens_center_px lies outside the picture";
  if (!in(optics.pixel_aspect, 1 / kMaxAspect, kMaxAspect)) return "pixel_aspect must be from 0.67 to 1.5";
  if (optics.camera_distance_mm != 0 && !in(optics.camera_distance_mm, kMinDistanceMm, 1e6))
    return "camera_distance_mm must be at least 5, or 0 for an orthographic camera";
  if (!(std::hypot(a * width_px, b * height_px) * pixel_pitch_mm <= kSteepestDome))
    return "gel_dome_per_mm makes the gel steeper than 0.5 (27 degrees) within the picture";
  return "";
}

std::string optics_text(const SensorOptics& optics) {
  const auto [a, b] = optics.gel_dome_per_mm;
  return (optics.camera_distance_mm > 0 ? fmt::format("camera at {:.4g} mm", optics.camera_distance_mm)
                                        : std::string("orthographic camera")) +
         (optics.has_lens() ? fmt::format(", lens k1 {:.3g}", optics.lens_k1) : ", no lens") +
         (a == 0 && b == 0 ? ", flat gel" : fmt::format(", dome {:.2g} and {:.2g} per mm", a, b));
}

void describe_optics(OptionVisitor& visit, SensorOptics& optics) {
  visit.number("lens_k1", optics.lens_k1, -kMaxK1, kMaxK1,
               "pixel radius = r (1 + k1 r²), in half picture widths; 0: no lens");
  visit.pair("lens_center_px", optics.lens_center_px, -1e4, 1e4, "principal point from the picture's center");
  visit.number("pixel_aspect", optics.pixel_aspect, 1 / kMaxAspect, kMaxAspect, "scale along x / along y");
  visit.number("camera_distance_mm", optics.camera_distance_mm, 0, 1e6,
               "behind the gel; at least 5, or 0: orthographic");
  visit.pair("gel_dome_per_mm", optics.gel_dome_per_mm, -1, 1, "a, b: the gel at rest is z = -(a x² + b y²)");
}

SensorOptics read_optics(const std::filesystem::path& file) {
  SensorOptics optics;
  read_options(file, [&](OptionVisitor& visit) { describe_optics(visit, optics); });
  return optics;
}

std::optional<SensorOptics> find_optics(const std::filesystem::path& beside) {
  const std::filesystem::path file = beside.parent_path() / kOpticsFileName;
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return std::nullopt;
  return read_optics(file);
}

void write_optics(const std::filesystem::path& file, const SensorOptics& optics) {
  SensorOptics copy = optics;
  write_file_atomically(file, write_options([&](OptionVisitor& visit) { describe_optics(visit, copy); }));
}

}  // namespace gelslam
