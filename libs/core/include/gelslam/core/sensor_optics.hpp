#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace gelslam {

class OptionVisitor;

/// How a sensor's camera sees its gel: seven numbers, by default of an orthographic camera over a flat gel.
/// A pixel's ray meets the plane z = 0 at the rest coordinates X. Pixels are counted from the principal
/// point, at which X = 0 is seen. With lengths in half picture widths:
///   r = (X_x √aspect, X_y / √aspect),   pixel = r (1 + k |r|²).
/// A point (x, y, z) of the sensor frame lies on the ray of X = (x, y) / (1 + z / distance). Where nothing
/// touches, z = -(a x² + b y²).
struct SensorOptics {
  double lens_k1 = 0;                           ///< k, per squared half image width; 0: no lens.
  std::array<double, 2> lens_center_px{0, 0};   ///< Principal point relative to the image center.
  double pixel_aspect = 1;                      ///< scale along x over y
  double camera_distance_mm = 0;                ///< Distance behind the plane; 0: orthographic.
  std::array<double, 2> gel_dome_per_mm{0, 0};  ///< a, b

  bool has_lens() const {
    return lens_k1 != 0 || lens_center_px != std::array{0.0, 0.0} || pixel_aspect != 1;
  }
  /// Returns 1/distance in 1/mm, and 0 for an orthographic camera, so that formulas need no special case.
  double inverse_distance() const { return camera_distance_mm > 0 ? 1 / camera_distance_mm : 0; }
  bool operator==(const SensorOptics&) const = default;
};

/// Returns why no sensor with images of this size can have these optics, or "".
std::string why_impossible(const SensorOptics& optics, int width_px, int height_px, double pixel_pitch_mm);

/// Returns a description for the user: "camera at 22 mm, lens k1 0.037, dome 0.0017 and 0.0028 per mm".
std::string optics_text(const SensorOptics& optics);

/// Converts the numbers to JSON under the names that they have in files. Called by nlohmann::json.
template <typename Json>
void to_json(Json& json, const SensorOptics& optics) {
  json = {{"lens_k1", optics.lens_k1},
          {"lens_center_px", optics.lens_center_px},
          {"pixel_aspect", optics.pixel_aspect},
          {"camera_distance_mm", optics.camera_distance_mm},
          {"gel_dome_per_mm", optics.gel_dome_per_mm}};
}
void describe_optics(OptionVisitor& visit, SensorOptics& optics);

/// Name of the optics file beside a gradient model or a calibration catalog.
inline constexpr const char* kOpticsFileName = "optics.yaml";

/// Reads an optics file. Throws Error with file and line, as read_options(). It does not check whether the
/// optics match the size of the images.
SensorOptics read_optics(const std::filesystem::path& file);
/// Reads the optics file in the folder of `beside`, if there is one.
std::optional<SensorOptics> find_optics(const std::filesystem::path& beside);
void write_optics(const std::filesystem::path& file, const SensorOptics& optics);

/// Systematic slope errors also mix the axes: the error that a slope along one axis causes in the slope along
/// the other one, relative to the error that it causes along its own axis.
inline constexpr double kCrossAxisShare = 0.3;

}  // namespace gelslam
