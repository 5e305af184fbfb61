#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The radius of the visible disk of a press, which people draw, is this much larger than that of the gel
/// touching the ball, because the disk includes the membrane's rim. The value is the median over hand-made
/// labels of real presses on GelSight Minis; the public recipe leaves out 4 of their pixels, 0.25 mm.
inline constexpr double kVisibleRimMm = 0.24092;

/// Contact of a ball with the gel, in pixels. `radius_px` is that of the visible disk.
struct ContactCircle {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
  /// Returns the radius within which the gel touches the ball.
  double on_ball_px(double pixel_pitch_mm) const { return radius_px - kVisibleRimMm / pixel_pitch_mm; }
  bool operator==(const ContactCircle&) const = default;
};

/// An image of a ball of known diameter pressed into the gel.
struct CalibrationPress {
  std::string name;  ///< its folder, relative to the set's: "6.310mm/0"
  double diameter_mm = 0.0;
  cv::Mat3b bgr;
  std::optional<ContactCircle> label;
  bool left_out = false;  ///< True if the user decided not to use it.
  /// Sentence for the user why its files cannot be used; empty if they can. If the image cannot be used,
  /// `bgr` is the background.
  std::string problem{};
  cv::Mat1b covered{};  ///< 255 where markers hide the gel (MarkerFiller); empty if there are none.

  bool shows_gel(int u, int v) const { return covered.empty() || covered(v, u) == 0; }
  double ball_px(double pixel_pitch_mm) const { return 0.5 * diameter_mm / pixel_pitch_mm; }  ///< its radius
};

/// Files of a press: its label, or, for a press that the user left out, the label under another name.
inline constexpr std::size_t kMaxPresses = 2'000;  ///< that a folder may hold
inline constexpr const char *kLabelFile = "label.npz", *kLeftOutFile = "left_out.npz";

/// A calibration folder of the public layout: catalog.csv (experiment_reldir,diameter(mm)), background.png,
/// `<experiment_reldir>/gelsight.png`, and `<experiment_reldir>/label.npz` (center, radius) for labeled
/// presses. This program adds left_out.npz, which replaces the label of a press that must not be used, and
/// optics.yaml with the optics of the sensor's camera.
struct PressSet {
  std::filesystem::path folder;
  cv::Mat3b background;
  std::vector<CalibrationPress> presses;  ///< in the catalog's order
  std::optional<SensorOptics> optics{};   ///< Optics of the sensor from optics.yaml.

  CameraModel camera(double pixel_pitch_mm) const {
    return {background.size(), pixel_pitch_mm, optics.value_or(SensorOptics{})};
  }
};

/// Reads a calibration folder. If a press's image is missing, damaged, empty or of another size than the
/// background, or if its label is no circle, this is recorded as the press's `problem`. Images are converted
/// to the light of the background (in_light_of()); an image that shows another gel is a problem, too, unless
/// `any_gel` is true. Throws Error, naming the file and a remedy, when the folder, catalog or background is
/// missing, when a line of the catalog is damaged, when a name is outside the folder or occurs twice, and for
/// more than 2000 presses.
PressSet read_press_set(const std::filesystem::path& folder, bool any_gel = false);

/// Prepares a set for labeling and training: fills in markers, also in the background, records them in
/// `covered`, and sets `optics` if the set has none. Throws Error for impossible optics, and as
/// require_readable_background(). Warnings are passed to `say_warning`.
void prepare(PressSet& set, const SensorOptics& optics, double pixel_pitch_mm, const std::string& device_name,
             const std::function<void(const std::string&)>& say_warning);

/// Reads label.npz: `center` (u, v) and `radius` in pixels, of any numeric type. Throws Error if it is
/// damaged.
ContactCircle read_label(const std::filesystem::path& path);

/// Writes `center` and `radius` as float64, as numpy.savez does. Throws Error if the file cannot be written.
void write_label(const std::filesystem::path& path, const ContactCircle& circle);

}  // namespace gelslam
