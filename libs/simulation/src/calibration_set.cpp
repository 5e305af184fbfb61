#include "gelslam/simulation/calibration_set.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "data_files.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using namespace simulation::detail;

constexpr std::array<double, 2> kDiametersMm = {6.31, 9.5};
constexpr int kBackgroundPictures = 10;
constexpr int kHeldOutFirst = 1'000'000;  // numbers of presses that training never uses
constexpr double kCircleShrinkPx = 2;     // the lens mixes in what lies outside
constexpr int kSamplesPerPress = 1500;
constexpr int kValidationEvery = 5;  // every fifth press shows the gradient scale instead of training
constexpr double kBackgroundShare = 0.2;

void check(const CalibrationSpec& spec) {
  if (spec.presses < kValidationEvery || spec.presses > 2000)
    throw Error("number of calibration presses must be between 5 and 2000");
}

/// Drift is what happens after the calibration, and specks that come with contact were not there yet.
OpticsOptions optics_at_calibration(const CalibrationSpec& spec) {
  OpticsOptions optics = spec.optics;
  optics.light_drift = false;
  return optics;
}

/// Pixels of dots are left out of a training: the others look as they do without dots.
CalibrationSpec without_dots(CalibrationSpec spec) {
  spec.optics.dot_spacing_mm = 0.0;
  return spec;
}

/// Angles of the ball's surface at a pixel inside the contact circle (ALGORITHMS of the public systems): the
/// label that a person with a ruler and a ball would have.
void add_press_samples(const CalibrationSpec& spec, const BallPress& press, Random& random,
                       TrainingSamples& samples) {
  const double ball_px = 0.5 * press.diameter_mm / spec.geometry.pixel_pitch_mm;
  const double circle = press.radius_px - kCircleShrinkPx;
  for (int k = 0; k < kSamplesPerPress && circle > 0; ++k) {
    const double radius = circle * std::sqrt(random.uniform()),
                 angle = random.uniform(0, 2 * std::numbers::pi);
    const int u = static_cast<int>(std::lround(press.center_px.x + radius * std::cos(angle)));
    const int v = static_cast<int>(std::lround(press.center_px.y + radius * std::sin(angle)));
    if (u < 0 || u >= press.bgr.cols || v < 0 || v >= press.bgr.rows) continue;
    const cv::Point2d place = cv::Point2f(press.view.place_px(v, u));
    const double dx = place.x - press.ball_px.x, dy = place.y - press.ball_px.y;
    const double down = std::sqrt(ball_px * ball_px - dx * dx - dy * dy);
    samples.add(press.bgr, u, v, static_cast<float>(std::atan2(dx, down)),
                static_cast<float>(std::atan2(dy, down)));
  }
}

void add_background_samples(const PressSimulator& simulator, std::size_t count, Random& random,
                            TrainingSamples& samples) {
  const cv::Mat3b bgr = simulator.untouched(2 * kHeldOutFirst);
  const cv::Mat2f slope = simulator.rest_slope();
  for (std::size_t k = 0; k < count; ++k) {
    const int v = static_cast<int>(random.below(static_cast<std::uint64_t>(bgr.rows))),
              u = static_cast<int>(random.below(static_cast<std::uint64_t>(bgr.cols)));
    samples.add(bgr, u, v, std::atan(slope(v, u)[0]), std::atan(slope(v, u)[1]));
  }
}

/// Read on true slope inside the contact circles. See measure_gradient_scale.
HeldOutScale scale_on(const GradientModel& network, const PressSimulator& simulator,
                      const std::vector<BallPress>& presses) {
  cv::Mat2f zero;
  cv::subtract(read_slopes(network, simulator.background()), simulator.rest_slope(), zero);
  cv::Vec2d read_true(0, 0), true_true(0, 0);
  double error_rad = 0, count = 0;
  for (const BallPress& press : presses) {
    const cv::Mat2f read = read_slopes(network, press.bgr);
    for (int v = 0; v < read.rows; ++v)
      for (int u = 0; u < read.cols; ++u) {
        const double circle = press.radius_px - kCircleShrinkPx;
        if (std::hypot(u - press.center_px.x, v - press.center_px.y) > circle) continue;
        for (int axis = 0; axis < 2; ++axis) {
          const double slope = read(v, u)[axis] - zero(v, u)[axis], truth = press.view.slope(v, u)[axis];
          read_true[axis] += slope * truth;
          true_true[axis] += truth * truth;
          error_rad += std::abs(std::atan(slope) - std::atan(truth));
          ++count;
        }
      }
  }
  if (!(true_true[0] > 0 && true_true[1] > 0))
    throw Error("the presses that should show the gradient scale have no contact");
  return {read_true[0] / true_true[0], read_true[1] / true_true[1], error_rad / count * kDegreesPerRadian};
}

/// Noise in the colors makes every regression read slopes too flat. Dividing its output by the gradient scale
/// on presses that it was not trained on takes that out.
void remove_scale(GradientModel& network, const HeldOutScale& scale) {
  const std::array<double, 2> factors = {1 / scale.x, 1 / scale.y};
  constexpr std::size_t last = GradientModel::kLayers - 1;
  const std::size_t inputs = network.weight(last).size() / factors.size();
  for (std::size_t axis = 0; axis < factors.size(); ++axis) {
    const auto factor = static_cast<float>(factors[axis]);
    network.bias(last)[axis] *= factor;
    for (float& weight : network.weight(last).subspan(axis * inputs, inputs)) weight *= factor;
  }
}

std::string press_folder(double diameter_mm, int number) {
  return fmt::format("{:.3f}mm/{}", diameter_mm, number);
}

}  // namespace

PressSimulator::PressSimulator(const CalibrationSpec& spec)
    : spec_((check(spec), spec)), optics_(spec.geometry, optics_at_calibration(spec)) {}

BallPress PressSimulator::press(int number) const {
  Random random(hash(spec_.seed ^ 0xca11b, static_cast<std::uint64_t>(number)));
  BallPress press;
  press.diameter_mm = kDiametersMm[static_cast<std::size_t>(number) % kDiametersMm.size()];
  const double radius = 0.5 * press.diameter_mm;
  const double x = random.uniform(-1, 1) * (spec_.geometry.half_width_mm() - 0.3);
  const double y = random.uniform(-1, 1) * (spec_.geometry.half_height_mm() - 0.3);
  const double depth = random.uniform(0.08, 0.33) * radius;
  PressedBall pressed =
      press_ball(optics_.gel_grid(), spec_.gel, radius, x, y, depth - spec_.geometry.rest_mm(x, y));
  // Numbers of their own, so that no picture shares its noise with a frame of a scan.
  press.bgr = optics_.render(pressed.gel, -1 - number, 0, false);
  press.view = optics_.view(pressed.gel);
  press.ball_px = pressed.center_px;
  const ImageCircle circle = seen_circle(optics_, pressed);
  press.center_px = circle.center_px;
  press.radius_px = circle.radius_px;
  press.gel = std::move(pressed.gel);
  return press;
}

cv::Mat3b PressSimulator::untouched(std::int64_t number) const {
  return optics_.render(gel_at_rest(optics_.gel_grid()), -1 - number, 0, false);
}

cv::Mat2f PressSimulator::rest_slope() const { return optics_.view(gel_at_rest(optics_.gel_grid())).slope; }

cv::Mat3b PressSimulator::background() const {
  cv::Mat3f sum(spec_.geometry.height_px, spec_.geometry.width_px, cv::Vec3f(0, 0, 0));
  for (int k = 0; k < kBackgroundPictures; ++k)
    cv::add(sum, untouched(3LL * kHeldOutFirst + k - 1), sum, cv::noArray(), CV_32F);
  cv::Mat3b mean;
  sum.convertTo(mean, CV_8U, 1.0 / kBackgroundPictures);
  return mean;
}

HeldOutScale measure_gradient_scale(const GradientModel& network, const CalibrationSpec& spec, int presses) {
  const PressSimulator simulator(spec);
  std::vector<BallPress> unseen;
  for (int k = 0; k < presses; ++k) unseen.push_back(simulator.press(kHeldOutFirst + k));
  return scale_on(network, simulator, unseen);
}

GradientModel train_on_presses(const CalibrationSpec& spec, ProgressSink& progress) {
  const PressSimulator simulator(spec);
  TrainingSamples samples;
  std::vector<BallPress> validation;
  Random random(hash(spec.seed, 0x7a41));
  progress.begin("pressing balls", spec.presses);
  for (int k = 0; k < spec.presses; ++k) {
    BallPress press = simulator.press(k);
    if (k % kValidationEvery == kValidationEvery - 1)
      validation.push_back(std::move(press));
    else
      add_press_samples(spec, press, random, samples);
    progress.update(k + 1);
  }
  progress.end();
  const auto background = static_cast<double>(samples.size()) * kBackgroundShare / (1 - kBackgroundShare);
  add_background_samples(simulator, static_cast<std::size_t>(background), random, samples);
  GradientModel network = train_network(samples, spec.training, progress);
  remove_scale(network, scale_on(network, simulator, validation));
  return network;
}

HeldOutScale write_calibration_folder(const std::filesystem::path& folder, const CalibrationSpec& spec,
                                      ProgressSink& progress) {
  const PressSimulator simulator(spec);
  make_folder(folder / "model");
  std::string catalog = "experiment_reldir,diameter(mm)\n";
  std::string circles = "experiment_reldir,center_u_px,center_v_px,radius_px\n";
  std::array<int, kDiametersMm.size()> numbers{};
  progress.begin("writing presses", spec.presses);
  for (int k = 0; k < spec.presses; ++k) {
    const BallPress press = simulator.press(k);
    const std::string name =
        press_folder(press.diameter_mm, numbers[static_cast<std::size_t>(k) % kDiametersMm.size()]++);
    make_folder(folder / name);
    write_png(folder / name / "gelsight.png", press.bgr);
    catalog += fmt::format("{},{:g}\n", name, press.diameter_mm);
    circles +=
        fmt::format("{},{:g},{:g},{:g}\n", name, press.center_px.x, press.center_px.y, press.radius_px);
    progress.update(k + 1);
  }
  progress.end();
  write_png(folder / "background.png", simulator.background());
  const GradientModel network = train_on_presses(without_dots(spec), progress);
  write_pth_model(folder / "model" / "nnmodel.pth", network);
  for (const std::filesystem::path& optics : {folder, folder / "model"})
    write_optics(optics / kOpticsFileName, spec.geometry.optics);
  write_file_atomically(folder / "circles.csv", circles);
  write_file_atomically(folder / "catalog.csv", catalog);
  return measure_gradient_scale(network, without_dots(spec), 12);
}

}  // namespace gelslam
