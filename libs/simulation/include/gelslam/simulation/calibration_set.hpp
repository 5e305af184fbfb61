#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/optics.hpp"

namespace gelslam {

/// Samples one after another: 5 features and 2 angles each.
struct TrainingSamples {
  std::vector<float> features, angles_rad;
  std::size_t size() const { return angles_rad.size() / 2; }
  void add(const cv::Mat3b& bgr, int u, int v, float angle_x_rad, float angle_y_rad);
};

struct TrainingOptions {
  int epochs = 60;
  int batch = 1024;
  double learning_rate = 2e-3;
  int halve_every_epochs = 8;
  std::uint64_t seed = 1;  ///< of first weights and of the order of samples
};

/// L1 loss, Adam (Kingma & Ba 2015); one thread, deterministic on one kind of processor. Throws Error for
/// options out of range or fewer samples than one batch.
GradientModel train_network(const TrainingSamples& samples, const TrainingOptions& options,
                            ProgressSink& progress);

/// Slopes (dh/dx, dh/dy) that the network reads in a picture; nothing is subtracted.
cv::Mat2f read_slopes(const GradientModel& network, const cv::Mat3b& bgr);

struct CalibrationSpec {
  int presses = 160;  ///< 5 .. 2000, over the whole gel, 6.31 and 9.5 mm balls in turn, various depths
  GelOptions gel;
  OpticsOptions optics;
  SensorGeometry geometry;
  std::uint64_t seed = 1;  ///< of places and depths
  TrainingOptions training;
};

/// One press of a ball, with the truth.
struct BallPress {
  cv::Mat3b bgr;
  GelShape gel;
  GelView view;
  double diameter_mm = 0;
  cv::Point2d ball_px;    ///< the ball's axis, on the grid of the gel
  cv::Point2d center_px;  ///< of the contact circle in the picture
  double radius_px = 0;   ///< of the contact circle in the picture
};

/// The sensor on which balls are pressed. Deterministic. Throws Error for parameters out of range.
class PressSimulator {
 public:
  explicit PressSimulator(const CalibrationSpec& spec);

  /// Any press can be asked for by number, in any order.
  BallPress press(int number) const;
  /// Mean of 10 pictures without contact, as a person would take it.
  cv::Mat3b background() const;
  /// One picture without contact.
  cv::Mat3b untouched(std::int64_t number) const;
  /// Slopes that it shows.
  cv::Mat2f rest_slope() const;

 private:
  CalibrationSpec spec_;
  Optics optics_;
};

/// How a network reads slopes of the gel inside the contact circles (less 2 px, where the
/// lens mixes in the membrane rim) of presses it has not seen: least-squares factor of read on
/// true slope, through 0 (1: unbiased), and the mean absolute error of the angles.
struct HeldOutScale {
  double x = 0, y = 0, mean_error_deg = 0;
};
HeldOutScale measure_gradient_scale(const GradientModel& network, const CalibrationSpec& spec, int presses);

/// Trains the published network on four fifths of the spec's presses by the published recipe (L1, Adam 2e-3,
/// batch 1024, a fifth of background pixels; fewer epochs), labels from the balls' geometry inside the
/// contact circles, where the camera really looks: surface slopes, those of the dome on the bare gel. The
/// other fifth shows its gradient scale, which is divided out.
GradientModel train_on_presses(const CalibrationSpec& spec, ProgressSink& progress);

/// Writes a calibration folder: catalog.csv, <d>mm/<n>/gelsight.png, background.png, circles.csv (the truth
/// about the contact circles), model/nnmodel.pth, optics.yaml and model/optics.yaml. Returns the gradient
/// scale on 12 held-out presses. The folder is made if it is not there.
HeldOutScale write_calibration_folder(const std::filesystem::path& folder, const CalibrationSpec& spec,
                                      ProgressSink& progress);

}  // namespace gelslam
