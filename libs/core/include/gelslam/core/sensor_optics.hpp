#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>

namespace gelslam {

class OptionVisitor;

/// How a sensor's camera sees its gel: seven numbers, by default of an orthographic camera over a flat gel.
/// A pixel's ray meets the plane z = 0 at the rest coordinates X. With pixels from the principal point and r
/// from X, both in half picture widths and r along x and y corrected by the aspect:
///   pixel = r (1 + k |r|²),   X = (r_x / √aspect, r_y √aspect).
/// A point (x, y, z) of the sensor frame lies on the ray of X = (x, y) / (1 + z / distance). Where nothing
/// touches, z = -(a x² + b y²).
struct SensorOptics {
  double lens_k1 = 0;                           ///< k, per half picture width squared; 0: no lens
  std::array<double, 2> lens_center_px{0, 0};   ///< principal point, from the picture's center
  double pixel_aspect = 1;                      ///< scale along x over y
  double camera_distance_mm = 0;                ///< behind the plane; 0: orthographic
  std::array<double, 2> gel_dome_per_mm{0, 0};  ///< a, b

  bool has_lens() const {
    return lens_k1 != 0 || lens_center_px != std::array{0.0, 0.0} || pixel_aspect != 1;
  }
  /// 1/mm, 0 for an orthographic camera: formulas need no other case.
  double inverse_distance() const { return camera_distance_mm > 0 ? 1 / camera_distance_mm : 0; }
  bool operator==(const SensorOptics&) const = default;
};

/// Why no sensor with such pictures has these optics, or "".
std::string why_impossible(const SensorOptics& optics, int width_px, int height_px, double pixel_pitch_mm);

/// For people: "camera at 22 mm, lens k1 0.037, dome 0.0017 and 0.0028 per mm".
std::string optics_text(const SensorOptics& optics);

/// The numbers under the names that files have for them. `Json`: nlohmann's, which calls this.
template <typename Json>
void to_json(Json& json, const SensorOptics& optics) {
  json = {{"lens_k1", optics.lens_k1},
          {"lens_center_px", optics.lens_center_px},
          {"pixel_aspect", optics.pixel_aspect},
          {"camera_distance_mm", optics.camera_distance_mm},
          {"gel_dome_per_mm", optics.gel_dome_per_mm}};
}
void describe_optics(OptionVisitor& visit, SensorOptics& optics);

/// Name of the file beside a model or a calibration's catalog.
inline constexpr const char* kOpticsFileName = "optics.yaml";

/// Throws Error with file and line, like read_options(). What the pictures must fit is not checked.
SensorOptics read_optics(const std::filesystem::path& file);
/// The file of optics in the folder of `beside`, if there is one.
std::optional<SensorOptics> find_optics(const std::filesystem::path& beside);
void write_optics(const std::filesystem::path& file, const SensorOptics& optics);

/// Error that a slope along one axis causes in the slope along the other, as a share of the error that it
/// causes in the slope along its own axis.
inline constexpr double kCrossAxisShare = 0.3;

}  // namespace gelslam
