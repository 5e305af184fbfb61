// The program's calibrate command, as a person uses it and as a person gets it wrong.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
  return run_program(GELSLAM_PROGRAM, arguments);
}

void expect_mistake(const ProgramResult& result, const std::string& words) {
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.error_lines(), 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr(words));
}

/// Sixteen presses, all over the gel.
const SimulatedPresses& few_presses() {
  static const SimulatedPresses presses = simulated_presses(0, 16);
  return presses;
}

TEST(CalibrateCommand, LabelsTrainsAndChecks) {
  const TemporaryFolder folder;
  const std::string presses = (folder / "presses").string(), model = (folder / "model.json").string(),
                    pth = (folder / "nnmodel.pth").string(), page = (folder / "check.html").string();
  write_folder(presses, few_presses().set);
  expect_mistake(calibrate({"train", presses, "-o", model}), "16 of 16 presses have no label");
  EXPECT_FALSE(fs::exists(model));

  const ProgramResult looked = calibrate({"label", presses, "--sheet", (folder / "sheet.png").string()});
  EXPECT_THAT(looked.err, HasSubstr("nothing was written"));
  EXPECT_FALSE(fs::exists(folder / "presses/press/0/label.npz"));
  EXPECT_FALSE(cv::imread((folder / "sheet.png").string()).empty());
  write_label(folder / "presses/press/0/label.npz", {50.0, 60.0, 20.0});  // a person's: is kept
  calibrate({"label", presses, "--accept"});
  EXPECT_EQ(read_label(folder / "presses/press/0/label.npz").u_px, 50.0);
  calibrate({"label", presses, "--accept", "--overwrite"});
  EXPECT_NEAR(read_label(folder / "presses/press/0/label.npz").u_px, few_presses().truth[0].centre_px.x, 4.0);

  const ProgramResult trained =
      calibrate({"train", presses, "-o", model, "--pth", pth, "--automatic", "--steps", "800"});
  ASSERT_LE(trained.exit_code, 1) << trained.err;
  EXPECT_THAT(trained.out, HasSubstr("trained on"));
  const ModelFile file = read_model_file(model);
  ASSERT_TRUE(file.record);
  EXPECT_EQ(file.record->diameters_mm, (std::vector<double>{6.31, 9.5}));
  EXPECT_EQ(read_model(pth).layers[2].weight, file.model.layers[2].weight);
  const std::string before = read_bytes(model);
  expect_mistake(calibrate({"train", presses, "-o", model}), "is already there");
  EXPECT_EQ(read_bytes(model), before);

  const ProgramResult checked = calibrate({"check", model, presses, "-o", page, "--json"});
  EXPECT_LE(checked.exit_code, 1);
  const auto json = nlohmann::json::parse(checked.out);
  EXPECT_LT(json["slope_error_deg"].get<double>(), 4.0);
  EXPECT_EQ(json["gain"]["ninths"].size(), 9U);
  EXPECT_THAT(read_bytes(page), HasSubstr("<h1>Calibration"));

  const std::string background = (folder / "presses/background.png").string();
  EXPECT_EQ(calibrate({"drift", background, "--model", model}).exit_code, 0);
  cv::imwrite((folder / "dark.png").string(), few_presses().set.background * 0.7);
  const ProgramResult dark = calibrate({"drift", (folder / "dark.png").string(), "--model", model});
  EXPECT_EQ(dark.exit_code, 1);
  EXPECT_THAT(dark.out, HasSubstr("the light has changed"));
  expect_mistake(calibrate({"drift", background, "--model", pth}), "give --background");
  expect_mistake(calibrate({"drift", background}), "give --model or --background");
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
  expect_mistake(train(), "take a picture of the gel with nothing on it");
  expect_mistake(calibrate({"check", (folder / "none.json").string(), presses}), "does not exist");
  EXPECT_EQ(folder.names(), std::vector<std::string>{"presses"});
  expect_mistake(calibrate({"train", presses, "-o", (folder / "none/model.json").string()}), "there is no folder");
  expect_mistake(calibrate({"train"}), "gelslam calibrate train --help");
  expect_mistake(calibrate({"tarin", presses}), "gelslam calibrate --help");
}

}  // namespace
}  // namespace gelslam::test
