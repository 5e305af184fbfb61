// Ball presses, the network trained on them, and the file it is written to (read by libs/surface, which
// shares no code).

#include "gelslam/simulation/calibration_set.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <sstream>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/surface/model_file.hpp"
#include "temporary_folder.hpp"

namespace gelslam {
namespace {

using test::read_bytes;
using test::TemporaryFolder;

CalibrationSpec small() {
  CalibrationSpec spec;
  spec.presses = 120;
  spec.training.epochs = 25;
  spec.training.halve_every_epochs = 4;
  return spec;
}

const GradientModel& trained() {
  NoProgress progress;
  static const GradientModel network = train_on_presses(small(), progress);
  return network;
}

TEST(BallPress, ShowsTheBallInsideItsCircle) {
  const PressSimulator simulator({});
  for (const int number : {0, 1, 7}) {
    const BallPress press = simulator.press(number);
    const double ball = 0.5 * press.diameter_mm;
    double error = 0;
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        const double dx = (u - press.center_px.x) * 0.0634, dy = (v - press.center_px.y) * 0.0634,
                     r = std::hypot(dx, dy);
        if (r > (press.radius_px - 2) * 0.0634) continue;
        const double down = std::sqrt(ball * ball - r * r);
        error = std::max({error, std::abs(press.gel.slope(v, u)[0] - dx / down),
                          std::abs(press.gel.slope(v, u)[1] - dy / down)});
      }
    EXPECT_LT(error, 0.02) << number;
    EXPECT_GT(press.radius_px, 8);
  }
}

TEST(Training, SlopesOfUnseenPressesAreUnbiased) {
  const HeldOutScale scale = measure_gradient_scale(trained(), small(), 16);
  EXPECT_NEAR(scale.x, 1, 0.03);
  EXPECT_NEAR(scale.y, 1, 0.03);
  EXPECT_LT(scale.mean_error_deg, 2.2);
}

TEST(Training, SlopesOfATexturedObjectAreUnbiasedToo) {
  ScanSpec spec;  // a pebble
  spec.motion.frames = 40;
  const Simulator simulator(spec);
  const cv::Mat2f zero = read_slopes(trained(), PressSimulator(small()).background());
  const SimulatedFrame frame = simulator.frame(40);
  const cv::Mat2f read = read_slopes(trained(), frame.bgr);
  cv::Vec2d read_true(0, 0), true_true(0, 0);
  for (int v = 0; v < read.rows; ++v)
    for (int u = 0; u < read.cols; ++u)
      for (int axis = 0; axis < 2; ++axis) {
        const double truth = frame.slope(v, u)[axis];
        read_true[axis] += (read(v, u)[axis] - zero(v, u)[axis]) * truth;
        true_true[axis] += truth * truth;
      }
  EXPECT_NEAR(read_true[0] / true_true[0], 1, 0.06);  // the lens softens fine texture
  EXPECT_NEAR(read_true[1] / true_true[1], 1, 0.06);
}

TEST(Training, PicturesIntegrateToTheTrueHeight) {
  // The whole way round: height -> picture -> slopes by the network -> height, integrated along rows.
  CalibrationSpec spec = small();
  spec.optics.noise_gain = 0;
  const PressSimulator simulator(spec);
  const cv::Mat2f zero = read_slopes(trained(), simulator.background());
  int rows = 0;
  for (int number = 500; number < 512; ++number) {
    const BallPress press = simulator.press(number);
    const int row = static_cast<int>(std::lround(press.center_px.y));
    if (row < 60 || row > 180 || press.center_px.x < 70 || press.center_px.x > 250) continue;
    const cv::Mat2f read = read_slopes(trained(), press.bgr);
    const int u0 = static_cast<int>(press.center_px.x - press.radius_px) - 25;
    const int u1 = static_cast<int>(std::lround(press.center_px.x));
    double height = 0;
    for (int u = std::max(0, u0); u < u1; ++u) height += 0.0634 * (read(row, u)[0] - zero(row, u)[0]);
    const double truth = press.gel.height_mm(row, u1) - press.gel.height_mm(row, std::max(0, u0));
    EXPECT_NEAR(height / truth, 1, 0.12) << number;
    ++rows;
  }
  EXPECT_GE(rows, 2);
}

TEST(Training, IsDeterministic) {
  CalibrationSpec spec = small();
  spec.presses = 10;
  spec.training.epochs = 2;
  NoProgress progress;
  const GradientModel a = train_on_presses(spec, progress), b = train_on_presses(spec, progress);
  EXPECT_EQ(a, b);
  spec.training.seed = 2;
  EXPECT_NE(a, train_on_presses(spec, progress));
}

TEST(Training, LearnsAKnownFunctionOfColor) {
  // Any derivative with a wrong sign or a forgotten layer stops this from going down.
  TrainingSamples samples;
  cv::Mat3b bgr(64, 64);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 64; ++u) {
      bgr(v, u) = cv::Vec3b(cv::saturate_cast<std::uint8_t>(4 * u), cv::saturate_cast<std::uint8_t>(4 * v),
                            static_cast<std::uint8_t>((u * v) % 256));
      samples.add(bgr, u, v, 0.5F * std::sin(0.1F * static_cast<float>(u)),
                  0.01F * static_cast<float>(v - u));
    }
  TrainingOptions options;
  options.epochs = 150;
  options.halve_every_epochs = 30;
  options.batch = 256;
  NoProgress progress;
  const cv::Mat2f read = read_slopes(train_network(samples, options, progress), bgr);
  double error = 0;
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 64; ++u)
      error += std::abs(std::atan(read(v, u)[0]) - 0.5F * std::sin(0.1F * static_cast<float>(u))) +
               std::abs(std::atan(read(v, u)[1]) - 0.01F * static_cast<float>(v - u));
  EXPECT_LT(error / (2 * 64 * 64), 0.01);  // the function's own mean size is about 0.3
}

TEST(PthFile, IsReadBackExactlyByTheEstimatorsReader) {
  const TemporaryFolder folder;
  write_pth_model(folder / "nnmodel.pth", trained());
  EXPECT_EQ(read_model(folder / "nnmodel.pth"), trained());
}

TEST(PthFile, SameNetworkSameBytesAndNothingHalfWritten) {
  const TemporaryFolder folder;
  write_pth_model(folder / "a.pth", trained());
  write_pth_model(folder / "b.pth", trained());
  EXPECT_EQ(read_bytes(folder / "a.pth"), read_bytes(folder / "b.pth"));
  EXPECT_THROW(write_pth_model(folder / "missing" / "c.pth", trained()), Error);
  EXPECT_EQ(folder.names(), (std::vector<std::string>{"a.pth", "b.pth"}));
}

TEST(CalibrationFolder, HasWhatItsCatalogNames) {
  const TemporaryFolder folder;
  CalibrationSpec spec = small();
  spec.presses = 10;
  spec.training.epochs = 2;
  NoProgress progress;
  write_calibration_folder(folder.path(), spec, progress);
  std::istringstream catalog(read_bytes(folder / "catalog.csv"));
  std::string line;
  std::getline(catalog, line);
  EXPECT_EQ(line, "experiment_reldir,diameter(mm)");
  int presses = 0;
  while (std::getline(catalog, line)) {
    EXPECT_TRUE(std::filesystem::exists(folder / line.substr(0, line.find(',')) / "gelsight.png")) << line;
    ++presses;
  }
  EXPECT_EQ(presses, 10);
  EXPECT_TRUE(std::filesystem::exists(folder / "background.png"));
  EXPECT_NO_THROW(read_model(folder / "model" / "nnmodel.pth"));
}

TEST(Calibration, MistakesAreErrors) {
  NoProgress progress;
  CalibrationSpec spec = small();
  spec.presses = 0;
  EXPECT_THROW(train_on_presses(spec, progress), Error);
  spec.presses = 1'000'000;
  EXPECT_THROW(train_on_presses(spec, progress), Error);
  TrainingSamples none;
  EXPECT_THROW(train_network(none, {}, progress), Error);
  TrainingSamples uneven;
  uneven.angles_rad.assign(4096, 0.0F);
  EXPECT_THROW(train_network(uneven, {}, progress), Error);
  TrainingOptions options;
  options.batch = 100;
  EXPECT_THROW(train_network(none, options, progress), Error);
  EXPECT_THROW(write_calibration_folder("/proc/none", small(), progress), Error);
}

}  // namespace
}  // namespace gelslam
