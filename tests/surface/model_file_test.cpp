#include "gelslam/surface/model_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "../support/temporary_folder.hpp"
#include "pth_file.hpp"

namespace gelslam::test {
namespace {

ModelFile some_file() {
  ModelFile file;
  file.model = random_model(3);
  CalibrationRecord record;
  record.width_px = 320;
  record.height_px = 240;
  record.pixel_pitch_mm = 0.0634;
  record.presses = 48;
  record.diameters_mm = {6.31, 9.5};
  record.seed = 18446744073709551615ULL;
  record.background_cells = cv::Mat3f(kBackgroundGrid, cv::Vec3f(10.25F, 200.5F, 77.75F));
  file.record = record;
  return file;
}

std::string refusal_of_text(const std::string& contents) {
  const TemporaryFolder folder;
  write_bytes(folder / "model.json", contents);
  return message_of([&] { read_model(folder / "model.json"); });
}

std::string good_text() {
  const TemporaryFolder folder;
  write_model_file(folder / "model.json", some_file());
  return read_bytes(folder / "model.json");
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ModelFile, ComesBackExactly) {
  const TemporaryFolder folder;
  const ModelFile written = some_file();
  write_model_file(folder / "model.json", written);
  ModelFile read = read_model_file(folder / "model.json");
  ASSERT_TRUE(read.record && read.model.bare_gel_bgr);
  const std::array<float, 3> color = mean_color(written.record->background_cells);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR((*read.model.bare_gel_bgr)[c], color[c], 0.006);
  read.model.bare_gel_bgr.reset();  // it is part of the record, not of the written model
  EXPECT_EQ(read.model, written.model);
  EXPECT_EQ(read.record->seed, written.record->seed);
  EXPECT_EQ(read.record->presses, 48);
  EXPECT_EQ(read.record->diameters_mm, written.record->diameters_mm);
  EXPECT_EQ(read.record->pixel_pitch_mm, 0.0634);
  EXPECT_LT(cv::norm(read.record->background_cells, written.record->background_cells, cv::NORM_INF), 0.006);
}

TEST(ModelFile, KeepsTheColorOfTheBareGelWithoutTheRecord) {
  const TemporaryFolder folder;
  ModelFile corrected = some_file();  // as `calibrate scale` writes one
  corrected.record.reset();
  corrected.model.bare_gel_bgr = {101.5F, 80.25F, 92};
  write_model_file(folder / "model.json", corrected);
  EXPECT_EQ(read_model(folder / "model.json"), corrected.model);
}

TEST(ModelFile, KeepsTheUncertaintyAndReadsFilesWithout) {
  const TemporaryFolder folder;
  ModelFile written = some_file();
  write_model_file(folder / "old.json", written);
  EXPECT_TRUE(read_model(folder / "old.json").sigma_rad.empty());
  for (int k = 0; k < GradientModel::kSigmaColumns * GradientModel::kSigmaRows; ++k)
    written.model.sigma_rad.push_back(0.02F + 0.001F * static_cast<float>(k));
  write_model_file(folder / "model.json", written);
  const std::vector<float> read = read_model(folder / "model.json").sigma_rad;
  ASSERT_EQ(read.size(), written.model.sigma_rad.size());
  for (std::size_t k = 0; k < read.size(); ++k)
    EXPECT_NEAR(read[k], written.model.sigma_rad[k], 6e-5) << "kept to a ten-thousandth";
  written.model.sigma_rad[7] = -1;
  write_model_file(folder / "bad.json", written);
  EXPECT_THAT(message_of([&] { read_model(folder / "bad.json"); }), HasSubstr("slope_sigma_rad"));
}

TEST(ModelFile, ReadsBothKindsByContentNotByName) {
  const TemporaryFolder folder;
  const ModelFile written = some_file();
  write_pth_model(folder / "a.json", written.model);
  write_model_file(folder / "b.pth", written);
  EXPECT_EQ(read_model(folder / "a.json"), written.model);
  EXPECT_EQ(read_model(folder / "b.pth").numbers, written.model.numbers);
  EXPECT_FALSE(read_model_file(folder / "a.json").record);
}

TEST(ModelFile, SaysWhatIsWrong) {
  const std::string good = good_text();
  EXPECT_THAT(refusal_of_text(""), HasSubstr("is neither an nnmodel.pth"));
  EXPECT_THAT(refusal_of_text("# a picture"), HasSubstr("is neither an nnmodel.pth"));
  EXPECT_THAT(refusal_of_text(std::string(kLfsPointer)), HasSubstr(kLfsAdvice));
  EXPECT_THAT(refusal_of_text(good.substr(0, good.size() / 2)), HasSubstr("damaged"));
  EXPECT_THAT(refusal_of_text("{}"), HasSubstr("'format' is missing"));
  EXPECT_THAT(refusal_of_text(replaced(good, "gelslam gradient", "another gradient")),
              HasSubstr("its 'format' is not"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"version\":1", "\"version\":2")), HasSubstr("newer gelslam"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"version\":1", "\"version\":\"1\"")),
              HasSubstr("'version' is no whole number"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"bias\":[", "\"bias\":[1.0,")),
              HasSubstr("has not 8, 16 ... 256 neurons"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"weight\":[", "\"weight\":[1e99,")), HasSubstr("'weight'"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"presses\":48", "\"presses\":-1")),
              HasSubstr("'presses' holds no good number"));
  EXPECT_THAT(refusal_of_text(replaced(good, "\"presses\":48", "\"presses\":4.5")),
              HasSubstr("'presses' is no whole number"));
  EXPECT_THAT(refusal_of_text(std::string(2'000'000, '[')), HasSubstr("neither"));
  EXPECT_THAT(refusal_of_text("{\"a\":" + std::string(900'000, '[')), HasSubstr("damaged"));
  EXPECT_THAT(refusal_of_text("{" + std::string(5 << 20, ' ') + "}"), HasSubstr("larger than 4 MiB"));
}

}  // namespace
}  // namespace gelslam::test
