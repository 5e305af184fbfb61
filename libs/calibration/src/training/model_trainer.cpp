// Trains the gradient model on presses of balls of known diameter. The recipe is that of the public system
// (Huang et al., GelSLAM) with the changes listed in docs/algorithms.md (Calibration): L2 loss on the
// difference of the readings of press and background, samples moved over the gel by a smooth color model
// (ColorField), and compensation of regression to the mean (ScaleField). Adam minimizes the loss with a
// cosine schedule of the learning rate.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "gelslam/calibration/calibrate.hpp"
#include "gelslam/core/error.hpp"
#include "training/color_field.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr std::size_t kBatch = 1024;
constexpr std::size_t kTile = kNetworkTile;
constexpr int kWantedTrainingSamples = 250'000;
constexpr int kStepsPerReport = 20;
constexpr double kLearningRate = 3e-3;  // Initial value for Adam; it falls to 0 along a cosine.
constexpr double kMoveShare = 0.5;      // Fraction of the samples that are moved to other places of the gel.
constexpr double kMoveReach = 0.15;     // Standard deviation of that movement, in image widths.
constexpr double kLightJitter = 0.01;   // Relative standard deviation per channel and sample.
// Scales colors, which vary by about a tenth, to the range of places, which vary by one. Larger factors learn
// noise.
constexpr float kColorFactor = 2.0F;
// Weight of a loss that keeps the reading of the background near 0, as only differences of readings are
// trained.
constexpr double kFlatAnchor = 0.02;

/// Random numbers that are the same on every platform, unlike the distributions of <random>.
class TrainingRandom {
 public:
  explicit TrainingRandom(std::uint64_t seed) : engine_(seed) {}
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(uniform() * static_cast<double>(n)); }
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double normal() {
    // Computed first, because the order in which operands are evaluated is not defined.
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

/// Scaling of the network's inputs during training: centered, with enlarged colors, which speeds up learning.
/// In the finished model it is contained in the first layer.
struct InputScaling {
  std::array<float, 5> middle = {0.0F, 0.0F, 0.0F, 0.5F, 0.5F};
  std::array<float, 5> factor = {kColorFactor, kColorFactor, kColorFactor, 1.0F, 1.0F};

  explicit InputScaling(const std::vector<SlopeSample>& samples) {
    std::array<double, 3> sum{};
    for (const SlopeSample& sample : samples)
      for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(sample.color[c]);
    for (std::size_t c = 0; c < 3; ++c)
      middle[c] = static_cast<float>(sum[c] / static_cast<double>(samples.size()));
  }

  float scaled(std::size_t input, float value) const { return (value - middle[input]) * factor[input]; }

  void fold_into(GradientModel& network) const {
    for (std::size_t neuron = 0; neuron < GradientModel::kShape.outputs(0); ++neuron)
      for (std::size_t k = 0; k < 5; ++k) {
        float& weight = network.weight(0)[neuron * 5 + k];
        weight *= factor[k];
        network.bias(0)[neuron] -= weight * middle[k];
      }
  }
};

class ModelTrainer {
 public:
  ModelTrainer(const PressSet& set, const std::vector<BallZone>& zones, const ModelTraining& training)
      : set_(set),
        steps_(training.steps),
        random_(training.seed),
        network_(initial_network([this] { return random_.normal(); })),
        samples_(zone_samples(set, zones, training.pixel_pitch_mm, kWantedTrainingSamples)),
        scaling_(samples_),
        field_(samples_),
        zone_shift_rad_(zones.size()) {
    if (samples_.size() < kBatch)
      throw Error("the presses show only " + std::to_string(samples_.size()) +
                  " pixels of ball: too few to train on; take more presses");
  }

  GradientModel run(ProgressSink& progress) {
    progress.begin("training", steps_);
    for (int step = 0; step < steps_; ++step) {
      const double rate = kLearningRate * 0.5 * (1.0 + std::cos(std::numbers::pi * step / steps_));
      train_step(rate, 2 * step > steps_);
      if (step % kStepsPerReport == 0) progress.update(step);
    }
    progress.update(steps_);
    progress.end();
    scaling_.fold_into(network_);
    return network_;
  }

 private:
  /// `correcting`: compensate regression to the mean (ScaleField).
  void train_step(double rate, bool correcting) {
    GradientModel gradient;
    for (std::size_t done = 0; done < kBatch; done += kTile) {
      load_tile();
      network_forward(network_, touched_);
      network_forward(network_, untouched_);
      set_derivatives(correcting);
      network_backward(network_, touched_, d_touched_, gradient);
      network_backward(network_, untouched_, d_untouched_, gradient);
    }
    if (correcting) scale_.update();
    adam_.step(network_, gradient, rate);
  }

  void load_tile() {
    for (std::size_t k = 0; k < kTile; ++k) {
      chosen_[k] = random_.below(samples_.size());
      SlopeSample& sample = tile_[k];
      sample = samples_[chosen_[k]];
      moved_[k] = random_.uniform() < kMoveShare;
      if (moved_[k]) move(sample);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto light = static_cast<float>(1.0 + kLightJitter * random_.normal());
        touched_.input[c * kTile + k] = scaling_.scaled(c, light * sample.color[c]);
        untouched_.input[c * kTile + k] = scaling_.scaled(c, light * sample.flat_color[c]);
      }
      for (std::size_t c = 0; c < 2; ++c)
        touched_.input[(3 + c) * kTile + k] = untouched_.input[(3 + c) * kTile + k] =
            scaling_.scaled(3 + c, sample.place[c]);
    }
  }

  /// Moves a sample to another place of the gel. Its color changes as the smooth color field predicts; the
  /// part that the field does not explain is kept.
  void move(SlopeSample& sample) {
    const int u = std::clamp(
                  sample.u_px + static_cast<int>(kMoveReach * random_.normal() * set_.background.cols), 0,
                  set_.background.cols - 1),
              v = std::clamp(
                  sample.v_px + static_cast<int>(kMoveReach * random_.normal() * set_.background.cols), 0,
                  set_.background.rows - 1);
    const std::array<float, 2> place = {static_cast<float>(u) / static_cast<float>(set_.background.cols),
                                        static_cast<float>(v) / static_cast<float>(set_.background.rows)};
    const auto here = field_.change(sample.place, sample.angle_rad),
               there = field_.change(place, sample.angle_rad);
    for (std::size_t c = 0; c < 3; ++c) {
      const float flat = static_cast<float>(set_.background(v, u)[static_cast<int>(c)]) / 255.0F;
      const float was = sample.flat_color[c],
                  unexplained = (sample.color[c] - was) / field_.unit(was) - here[c];
      sample.color[c] = flat + field_.unit(flat) * (there[c] + unexplained);
      sample.flat_color[c] = flat;
    }
    sample.place = place;
  }

  /// Returns the sample's true angles after shifting its circle to where the network sees it. An error of the
  /// circle shifts all angles of a press, which would bias the regression toward too flat slopes.
  std::array<float, 2> recentered_angle_rad(const SlopeSample& sample, const std::array<float, 2>& read) {
    constexpr float follow = 0.005F;
    std::array<float, 2>& shift = zone_shift_rad_[static_cast<std::size_t>(sample.zone)];
    std::array<float, 2> angle = sample.angle_rad;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      shift[axis] += follow * (read[axis] - angle[axis] - shift[axis]);
      angle[axis] += shift[axis];
    }
    return angle;
  }

  void set_derivatives(bool correcting) {
    const float size = 1.0F / static_cast<float>(kBatch);
    for (std::size_t k = 0; k < kTile; ++k) {
      const SlopeSample& sample = tile_[k];
      std::array<float, 2> read{}, wanted = sample.angle_rad;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::size_t at = axis * kTile + k;
        read[axis] = touched_.output[at] - untouched_.output[at];
      }
      if (!moved_[k]) {
        const std::array<float, 2> truth = recentered_angle_rad(sample, read);
        if (correcting) scale_.note(sample.place, read, truth);
      }
      if (correcting) wanted = scale_.stretched(sample.place, sample.angle_rad);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::size_t at = axis * kTile + k;
        const float derivative = 2.0F * size * (read[axis] - wanted[axis]);
        d_touched_[at] = derivative;
        d_untouched_[at] =
            -derivative + 2.0F * size * static_cast<float>(kFlatAnchor) * untouched_.output[at];
      }
    }
  }

  const PressSet& set_;
  int steps_;
  TrainingRandom random_;
  GradientModel network_;
  Adam adam_;
  std::vector<SlopeSample> samples_;
  InputScaling scaling_;
  ColorField field_;
  std::array<SlopeSample, kTile> tile_;
  std::array<bool, kTile> moved_{};
  ScaleField scale_;
  /// For each zone, the mean difference between the network's readings and the labels.
  std::vector<std::array<float, 2>> zone_shift_rad_;
  NetworkTile touched_, untouched_;
  NetworkTile::Values<2> d_touched_{}, d_untouched_{};
  std::array<std::size_t, kTile> chosen_{};
};

}  // namespace

GradientModel train_model(const PressSet& set, const std::vector<BallZone>& zones,
                          const ModelTraining& training, ProgressSink& progress) {
  return ModelTrainer(set, zones, training).run(progress);
}

}  // namespace gelslam
