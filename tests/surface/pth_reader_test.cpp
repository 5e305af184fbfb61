#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"
#include "pth_file.hpp"

namespace gelslam::test {
namespace {

using ::testing::HasSubstr;

PthFile good_file() {
  PthFile file;
  file.layers = random_layers(1);
  return file;
}

GradientModel read(const std::string& bytes) {
  return parse_pth_model({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, "nnmodel.pth");
}

GradientModel read(const PthFile& file) { return read(zip_archive(file.entries())); }

template <class Input>
std::string refusal(const Input& input) {
  return message_of<Error>([&] { read(input); });
}

TEST(PthReader, GivesBackEveryNumberThatWasWritten) {
  const PthFile file = good_file();
  const GradientModel model = read(file);
  const std::vector<PthLayer> layers = layers_of(model);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(layers[i].weight, file.layers[i].weight);
    EXPECT_EQ(layers[i].bias, file.layers[i].bias);
  }
}

TEST(PthReader, ReadsOlderFilesWithoutByteOrderAndMetadata) {
  PthFile file = good_file();
  file.more_entries.clear();
  file.with_metadata = false;
  file.root = "archive";
  EXPECT_EQ(layers_of(read(file))[3].bias, file.layers[3].bias);
}

TEST(PthReader, RefusesOtherLayerSizesAndNamesThem) {
  PthFile file = good_file();
  file.layers = random_layers(1, {5, 32, 64, 32, 2});
  EXPECT_THAT(refusal(file), HasSubstr("fc2.weight 64x32, fc2.bias 64, fc3.weight 32x64"));
  EXPECT_THAT(refusal(file), HasSubstr("5-32-32-32-2 (nnmodel.pth) and 5-64-64-64-2 (nnmini.pt)"));
  file.layers = random_layers(1, {5, 32, 32, 2});
  EXPECT_THAT(refusal(file), HasSubstr("fc3.weight 2x32, fc3.bias 2; read are"));
  file.layers = random_layers(1, {5, 64, 64, 32, 2});
  file.checkpoint = true;
  EXPECT_THAT(refusal(file), HasSubstr("fc3.weight 32x64"));
}

TEST(PthReader, NamesTheLayersOfNetworksThatHoldOtherNumbersToo) {
  PthFile file = good_file();
  file.batch_norm = true;
  EXPECT_THAT(refusal(file),
              HasSubstr("its layers are fc1.weight 32x5, fc1.bias 32, bn1.running_mean 32, "
                        "bn1.num_batches_tracked, fc2.weight 32x32, fc2.bias 32, bn2.running_mean 32, "
                        "bn2.num_batches_tracked and 6 more; read are"));
  file.layers = random_layers(1, std::vector<int>(41, 8));
  EXPECT_THAT(refusal(file), HasSubstr("bn2.num_batches_tracked and 150 more; read are"));
  file.checkpoint = true;
  file.entry = "model_state_dict";
  EXPECT_THAT(refusal(file), HasSubstr("its layers are fc1.weight 8x8, fc1.bias 8, bn1.running_mean 8"));
}

TEST(PthReader, ReadsTheNetworkOfTheMakersCheckpoint) {
  PthFile file;
  file.layers = random_maker_layers(2);
  file.checkpoint = true;
  const GradientModel model = read(file);
  ASSERT_TRUE(model.maker);
  EXPECT_EQ(model.numbers, GradientModel().numbers);
  for (std::size_t l = 0; l < 4; ++l)
    for (std::size_t k = 0; k < file.layers[l].weight.size(); ++k) {
      const bool of_position = l == 0 && k % 5 >= 3;  // of which the network sees zeros
      ASSERT_EQ(model.maker->weight(l)[k], of_position ? 0.0F : file.layers[l].weight[k]);
      ASSERT_EQ(model.maker->bias(l)[k / 64], file.layers[l].bias[k / 64]);
    }
  file.checkpoint = false;
  EXPECT_EQ(read(file), model);
  const std::string whole = zip_archive(file.entries());
  EXPECT_THAT(refusal(whole.substr(0, 30000)), HasSubstr("not a zip archive, or truncated"));
}

TEST(PthReader, RefusesGlobalsThatCouldRunCode) {
  PthFile file = good_file();
  file.rebuild_function = "os system";
  EXPECT_THAT(refusal(file), HasSubstr("'os.system', which a gradient model does not need; refused"));
  file.rebuild_function = "torch._utils _rebuild_tensor_v3";
  EXPECT_THAT(refusal(file), HasSubstr("refused"));
}

TEST(PthReader, RefusesInstructionsAStateDictDoesNotNeed) {
  auto entries = good_file().entries();
  std::string& pickle = entries["nnmodel/data.pkl"];
  pickle.insert(2, "(ios\nsystem\n");  // INST
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("pickle instruction 0x69 at byte 3"));
}

TEST(PthReader, RefusesOtherNumberTypes) {
  PthFile file = good_file();
  file.storage_class = "torch DoubleStorage";
  EXPECT_THAT(refusal(file), HasSubstr("torch.DoubleStorage, only float32"));
  file = good_file();
  file.more_entries["byteorder"] = "big";
  EXPECT_THAT(refusal(file), HasSubstr("not little-endian"));
}

TEST(PthReader, RefusesMissingShortAndOversizedData) {
  auto entries = good_file().entries();
  entries.erase("nnmodel/data/3");
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("'nnmodel/data/3' is missing"));
  entries = good_file().entries();
  entries["nnmodel/data/2"].resize(4092);
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("'fc2.weight' is truncated or damaged"));
  entries["nnmodel/data/2"].resize(1 << 20);
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("too large"));
  entries = good_file().entries();
  entries["nnmodel/data.pkl"].resize(400);
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("data.pkl is truncated"));
}

TEST(PthReader, RefusesToReadBeyondTheStoredNumbers) {
  PthFile file = good_file();
  file.storage_offset = 1;
  EXPECT_THAT(refusal(file), HasSubstr("'fc1.weight' is truncated or damaged"));
  file.storage_offset = -1;
  EXPECT_THAT(refusal(file), HasSubstr("damaged"));
}

TEST(PthReader, RefusesNumbersThatAreNone) {
  PthFile file = good_file();
  file.layers[2].bias[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal(file), HasSubstr("'fc3.bias' holds NaN or infinity"));
}

TEST(PthReader, RefusesWhatIsNoModelFile) {
  const std::string whole = zip_archive(good_file().entries());
  EXPECT_THAT(refusal(std::string("this is no zip")), HasSubstr("not a zip archive"));
  EXPECT_THAT(refusal(std::string()), HasSubstr("no data.pkl"));  // an empty file is an empty archive
  EXPECT_THAT(refusal(whole.substr(0, whole.size() / 2)), HasSubstr("not a zip archive, or truncated"));
  EXPECT_THAT(refusal(zip_archive({{"readme.txt", "hello"}})), HasSubstr("no data.pkl"));
  const TemporaryFolder folder;
  write_bytes(folder / "nnmodel.pth", std::string(5 << 20, 'x'));
  EXPECT_THAT(message_of<Error>([&] { read_model(folder / "nnmodel.pth"); }), HasSubstr("larger than 4 MiB"));
}

TEST(PthReader, SaysWhichFileIsMissing) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<Error>([&] { read_model(folder / "no.pth"); }), HasSubstr("no.pth' does not exist"));
  EXPECT_THAT(message_of<Error>([&] { read_model(folder.path()); }), HasSubstr("is no file"));
}

}  // namespace
}  // namespace gelslam::test
