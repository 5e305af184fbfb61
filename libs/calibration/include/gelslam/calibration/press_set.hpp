#pragma once

#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The radius of the disc that people see and draw is this much larger than that of the gel that lies on the
/// ball, because the disc includes the membrane's rim. The value is the median over hand-made labels of real
/// presses on GelSight Minis; the public recipe leaves out 4 of their pixels, 0.25 mm.
inline constexpr double kVisibleRimMm = 0.24092;

/// Where a ball touches the gel, in pixels. `radius_px` is that of the disc.
struct ContactCircle {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
  /// Returns the radius inside which the gel lies on the ball.
  double on_ball_px(double pixel_pitch_mm) const { return radius_px - kVisibleRimMm / pixel_pitch_mm; }
  bool operator==(const ContactCircle&) const = default;
};

/// One picture of a ball of known diameter pressed into the gel.
struct CalibrationPress {
  std::string name;  ///< its folder, relative to the set's: "6.310mm/0"
  double diameter_mm = 0.0;
  cv::Mat3b bgr;
  std::optional<ContactCircle> label;
  bool left_out = false;  ///< a person said that it is not to be used
  /// For people: why its files cannot be used; empty when they can. Without a usable picture `bgr` is the
  /// background.
  std::string problem{};
  cv::Mat1b covered{};  ///< 255 where markers hide the gel (MarkerFiller); empty: nowhere

  bool shows_gel(int u, int v) const { return covered.empty() || covered(v, u) == 0; }
  double ball_px(double pixel_pitch_mm) const { return 0.5 * diameter_mm / pixel_pitch_mm; }  ///< its radius
};

/// Files of a press: its label, or in its place the same of a press that a person has left out.
inline constexpr std::size_t kMaxPresses = 2'000;  ///< that a folder may hold
inline constexpr const char *kLabelFile = "label.npz", *kLeftOutFile = "left_out.npz";

/// A calibration folder of the public layout: catalog.csv (experiment_reldir,diameter(mm)), background.png,
/// `<experiment_reldir>/gelsight.png` and, where labeled, `<experiment_reldir>/label.npz` (center, radius);
/// our own left_out.npz takes the label's place where a press is not to be used, and optics.yaml says how the
/// sensor's camera sees the gel.
struct PressSet {
  std::filesystem::path folder;
  cv::Mat3b background;
  std::vector<CalibrationPress> presses;  ///< in the catalog's order
  std::optional<SensorOptics> optics{};   ///< of the sensor, as optics.yaml says

  CameraModel camera(double pixel_pitch_mm) const {
    return {background.size(), pixel_pitch_mm, optics.value_or(SensorOptics{})};
  }
};

/// Reads all of it. A picture that is missing, damaged, empty or of another size than the background, and a
/// label that is no circle, are its press's `problem`. Throws Error, naming the file and what to do: no
/// folder, catalog or background, a damaged line, a name that leaves the folder or comes twice, more than
/// 2000 presses. Pictures are turned into the light of the background (in_light_of()); one that does not show
/// its gel is a problem, too, unless `any_gel`.
PressSet read_press_set(const std::filesystem::path& folder, bool any_gel = false);

/// Readies a set for labels and training: fills in markers, in the background, too, notes them in `covered`,
/// and sets `optics` where it has none. Throws Error for optics that no sensor has, and like
/// require_readable_background(); warnings go to `say_warning`.
void prepare(PressSet& set, const SensorOptics& optics, double pixel_pitch_mm, const std::string& device_name,
             const std::function<void(const std::string&)>& say_warning);

/// label.npz: `center` (u, v) and `radius` in pixels, numbers of any kind. Throws Error when damaged.
ContactCircle read_label(const std::filesystem::path& path);

/// float64 `center` and `radius`, as numpy.savez writes them. Throws Error when the disk does not take it.
void write_label(const std::filesystem::path& path, const ContactCircle& circle);

}  // namespace gelslam
