// The program's calibrate command, as a person uses it and as a person gets it wrong.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../support/run_program.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/surface/model_file.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

ProgramResult calibrate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "calibrate");
  return gelslam(arguments);
}

/// Sixteen presses, all over the gel.
const SimulatedPresses& few_presses() {
  static const SimulatedPresses presses = simulated_presses(0, 16);
  return presses;
}

/// All pictures with red and blue in each other's place.
PressSet swapped(PressSet set) {
  const auto swap = [](cv::Mat3b& picture) {
    cv::Mat3b other;
    cv::cvtColor(picture, other, cv::COLOR_BGR2RGB);
    picture = other;
  };
  swap(set.background);
  for (CalibrationPress& press : set.presses) swap(press.bgr);
  return set;
}

TEST(CalibrateCommand, RefusesGelsWithTooManyMarkersAndSwappedColors) {
  const TemporaryFolder folder;
  PressSet set = labelled(few_presses(), 1.0, 4.0);
  set.presses.resize(2);
  write_folder(folder / "swapped", swapped(set));
  const std::string swapped_presses = (folder / "swapped").string(), model = (folder / "model.json").string();
  expect_mistake(calibrate({"collect", swapped_presses, "--headless"}), "red and blue seem to be swapped");
  expect_mistake(calibrate({"train", swapped_presses, "-o", model}), "red and blue seem to be swapped");
  write_bytes(folder / "other.yaml", "device_config:\n  device_name: \"DIGIT\"\n  ppmm: 0.05\n");
  const ProgramResult other = calibrate(
      {"collect", swapped_presses, "--headless", "-q", "--config", (folder / "other.yaml").string()});
  EXPECT_LE(other.exit_code, 1) << "lamps that are not known are not judged: " << other.err;
  PressSet other_gel = few_presses().set;
  other_gel.background = other_gel.background.clone();
  for (int u = 0; u < other_gel.background.cols; ++u)
    other_gel.background.col(u) *= 0.75 + 0.5 * u / other_gel.background.cols;
  write_folder(folder / "gel", other_gel);
  const ProgramResult once = calibrate({"collect", (folder / "gel").string(), "--headless"});
  EXPECT_EQ(once.exit_code, 1);
  EXPECT_THAT(once.err, HasSubstr(" and 15 others: its untouched gel does not look like background.png"));
  set.background = set.background.clone();
  for (int v = 20; v < 240; v += 20)
    for (int u = 20; u < 310; u += 20)
      cv::circle(set.background, {u, v}, 5, cv::Scalar(30, 30, 30), cv::FILLED);
  write_folder(folder / "dots", set);
  expect_mistake(calibrate({"collect", (folder / "dots").string(), "--headless"}),
                 "too little is left to read slopes from");
  expect_mistake(calibrate({"train", (folder / "dots").string(), "-o", model}),
                 "use a gel with fewer markers or none");
}

TEST(CalibrateCommand, LabelsAndTrainsThroughTheOpticsOnWhatCanBeUsed) {
  const TemporaryFolder folder;
  const std::string presses = (folder / "presses").string(), model = (folder / "model.json").string();
  const auto train = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"train", presses, "-o", model, "--steps", "100"});
    return calibrate(more);
  };
  write_folder(presses, few_presses().set);
  expect_mistake(train({}), "16 of 16 presses have no label");
  EXPECT_FALSE(fs::exists(model));
  write_label(folder / "presses/press/1/label.npz", {50.0, 60.0, 20.0});  // a person's: is kept
  write_bytes(folder / "presses/press/3/gelsight.png", "no picture");
  const ProgramResult labelled = calibrate({"collect", presses, "--headless"});
  EXPECT_EQ(labelled.exit_code, 1);
  EXPECT_THAT(labelled.err, HasSubstr("press/3/gelsight.png"));
  EXPECT_NEAR(read_label(folder / "presses/press/0/label.npz").u_px, few_presses().truth[0].center_px.x, 4.0);
  EXPECT_EQ(read_label(folder / "presses/press/1/label.npz").u_px, 50.0);
  EXPECT_FALSE(fs::exists(folder / "presses/press/3/label.npz"));

  fs::remove(folder / "presses/press/1/label.npz");
  const SensorOptics optics = {0.02, {1, 0}, 1.01, 25, {0.001, 0.002}};
  write_optics(folder / "presses/optics.yaml", optics);
  const ProgramResult trained = train({"--automatic"});
  ASSERT_LE(trained.exit_code, 1) << trained.err;
  EXPECT_THAT(trained.err, HasSubstr("left out: press/3: "));
  EXPECT_EQ(read_model(model).optics, optics);
  const std::string before = read_bytes(model);
  expect_mistake(train({"--automatic"}), "is already there");
  EXPECT_EQ(read_bytes(model), before);
  SensorOptics near = optics;
  near.camera_distance_mm = 2;
  write_optics(folder / "presses/optics.yaml", near);
  expect_mistake(train({"--overwrite"}), "camera_distance_mm must be at least 5");
}

TEST(CalibrateCommand, LabelsThatAllLieAsideAndPressesOfTheTrainingAreSaid) {
  const TemporaryFolder folder;
  PressSet set = labelled(few_presses(), 1.0, 4.0);
  const std::string right = (folder / "right").string(), aside = (folder / "aside").string(),
                    model = (folder / "model.json").string();
  write_folder(right, set);
  for (CalibrationPress& press : set.presses) press.label->u_px += 3.6;
  write_folder(aside, set);
  const ProgramResult trained = calibrate({"train", right, "-o", model, "--steps", "100"});
  EXPECT_THAT(trained.err, testing::Not(HasSubstr("aside")));
  EXPECT_THAT(trained.err, testing::Not(HasSubstr("PyTorch")));
  const ProgramResult pth = calibrate({"train", right, "-o", (folder / "m.pth").string(), "--steps", "100"});
  EXPECT_THAT(pth.err, HasSubstr("holds neither optics nor uncertainty: also write GelSLAM's own"));
  const char* const words = "labels lie aside of the contacts by +3.";
  const ProgramResult wrong =
      calibrate({"train", aside, "-o", (folder / "wrong.json").string(), "--steps", "100"});
  EXPECT_THAT(wrong.err, HasSubstr(words));
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(calibrate({"check", model, aside}).out, HasSubstr(words));
  const char* const same = "these seem to be the presses that the model was trained on";
  EXPECT_THAT(calibrate({"check", model, right}).out, HasSubstr(same));
  set.presses.pop_back();
  write_folder(folder / "fewer", set);
  EXPECT_THAT(calibrate({"check", model, (folder / "fewer").string()}).out, testing::Not(HasSubstr(same)));
}

TEST(CalibrateCommand, RefusesBadPressesAndWritesNothing) {
  const TemporaryFolder folder;
  const std::string presses = (folder / "presses").string(), model = (folder / "model.json").string();
  const auto train = [&] { return calibrate({"train", presses, "-o", model}); };
  expect_mistake(train(), "is no folder of ball presses");
  PressSet set = labelled(few_presses(), 1.0, 4.0);
  set.presses.resize(5);
  write_folder(presses, set);
  expect_mistake(train(), "at least 10 are needed");
  fs::remove(folder / "presses/background.png");
  expect_mistake(train(), "put a picture of the same gel with nothing on it");
  expect_mistake(calibrate({"check", (folder / "none.json").string(), presses}), "does not exist");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"presses"});
  expect_mistake(calibrate({"train", presses, "-o", (folder / "none/model.json").string()}),
                 "there is no folder");
  expect_mistake(calibrate({"train"}), "gelslam calibrate train --help");
}

}  // namespace
}  // namespace gelslam::test
