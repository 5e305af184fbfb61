#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "../support/temporary_folder.hpp"
#include "gelslam/surface/model_file.hpp"
#include "pth_file.hpp"

namespace gelslam::test {
namespace {

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
  return message_of([&] { read(input); });
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
  file.layers = random_layers(1, {5, 32, 257, 32, 2});
  EXPECT_THAT(refusal(file), HasSubstr("fc2.weight 257x32, fc2.bias 257, fc3.weight 32x257"));
  EXPECT_THAT(refusal(file), HasSubstr("5 inputs, 2 outputs and at most 256 neurons between"));
  file.layers = random_layers(1, {5, 32, 32, 2});
  EXPECT_THAT(refusal(file), HasSubstr("fc3.weight 2x32, fc3.bias 2; read are"));
  file.layers = random_layers(1, {6, 64, 64, 32, 2});
  file.checkpoint = true;
  EXPECT_THAT(refusal(file), HasSubstr("fc3.weight 32x64"));
}

/// There is a kernel for each instruction set, and all that this processor supports are tested.
void expect_reads_as(const PthFile& file) {
  const std::vector<double> inputs = {0.9, 0.2, 0.5, 0.3, 0.7}, expected = naive_angles(file, inputs);
  const GradientModel model = read(file);
  NetworkTile tile;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    std::fill_n(tile.input.data() + i * kNetworkTile, kNetworkTile, static_cast<float>(inputs[i]));
  for (int level = 1; level <= instruction_level(); ++level) {
    const FrozenNetwork network(model, level);
    network.forward(tile);
    for (std::size_t o = 0; o < 2; ++o)
      EXPECT_NEAR(tile.output[o * kNetworkTile + 5], expected[o], 2e-6 * (1 + std::abs(expected[o])))
          << level;
    NetworkJacobian jacobian;
    network.jacobian(tile, jacobian);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      constexpr double step = 1e-6;
      std::vector<double> more = inputs;
      more[i] += step;
      const std::vector<double> moved = naive_angles(file, more);
      for (std::size_t o = 0; o < 2; ++o)
        EXPECT_NEAR(jacobian.of_output[o][i * kNetworkTile + 5], (moved[o] - expected[o]) / step, 2e-5)
            << level << " " << i;
    }
  }
}

TEST(PthReader, ReadsTheNetworkOfTheMakersCheckpoint) {
  PthFile file = makers_file(2);
  expect_reads_as(file);
  const GradientModel model = read(file);
  ASSERT_TRUE(model.wide);
  EXPECT_TRUE(model.wide->gives_normals);
  const float* number = model.wide->numbers.data();
  EXPECT_EQ(model.numbers, GradientModel().numbers);
  for (std::size_t l = 0; l < 4; ++l) {
    for (std::size_t k = 0; k < file.layers[l].weight.size(); ++k) {
      const std::size_t column = l == 0 ? k % 5 : 0;  // it takes v/H before u/W
      ASSERT_EQ(*number++, file.layers[l].weight[column == 3 ? k + 1 : column == 4 ? k - 1 : k]);
    }
    for (const float bias : file.layers[l].bias) ASSERT_EQ(*number++, bias);
  }
  file.checkpoint = false;
  EXPECT_EQ(read(file), model);
  const std::string whole = zip_archive(file.entries());
  EXPECT_THAT(refusal(whole.substr(0, 30000)), HasSubstr("no zip archive, or truncated"));
}

// Before 26 February 2025, the models of the public system had 1x1 convolutions.
TEST(PthReader, FoldsBatchNormalizationIntoTheLayers) {
  PthFile file;
  file.layers = random_layers(3, {5, 128, 32, 32, 2});
  expect_reads_as(file);
  file.norms = random_norms(4, file.layers);
  expect_reads_as(file);
  file.layer_name = "conv";
  expect_reads_as(file);
  file.norms[1].running_var[3] = -1;
  EXPECT_THAT(refusal(file), HasSubstr("'bn2' holds NaN or infinity"));
  file.norms.pop_back();
  file.norms[1].running_var[3] = 1;
  expect_reads_as(file);
}

TEST(PthReader, ReadsAnyWidthsUpTo256) {
  for (const std::vector<int>& sizes :
       {std::vector{5, 32, 32, 32, 2}, {5, 1, 7, 32, 2}, {5, 33, 20, 1, 2}, {5, 256, 256, 256, 2}}) {
    PthFile file;
    file.layers = random_layers(5, sizes);
    for (PthLayer& layer : file.layers)
      for (float& weight : layer.weight) weight *= 4 / std::sqrt(static_cast<float>(layer.inputs));
    expect_reads_as(file);
  }
}

TEST(PthReader, ReadsEveryProtocolAndTheNamesOfWrappers) {
  PthFile file = good_file();
  const GradientModel model = read(file);
  for (const int protocol : {2, 3, 4, 5})
    for (const char* prefix : {"", "module.", "model.", "module.model.", "model.module."}) {
      file.protocol = protocol;
      file.prefix = prefix;
      file.checkpoint = protocol % 2 == 1;
      EXPECT_EQ(read(file), model) << protocol << prefix;
    }
  file.protocol = 6;
  EXPECT_THAT(refusal(file), HasSubstr("pickle protocol is none of 2 to 5"));
  file.protocol = 4;
  file.rebuild_function = "os system";
  EXPECT_THAT(refusal(file), HasSubstr("'os.system', which a gradient model does not need; refused"));
}

TEST(PthReader, ReadsDoubleAndHalfPrecision) {
  PthFile file = good_file();
  for (PthLayer& layer : file.layers)
    for (std::vector<float>* values : {&layer.weight, &layer.bias})
      for (float& value : *values) value = std::round(value * 1024) / 1024;  // a half holds it
  const GradientModel model = read(file);
  for (const char* storage : {"torch DoubleStorage", "torch HalfStorage"}) {
    file.storage_class = storage;
    EXPECT_EQ(read(file), model) << storage;
  }
}

TEST(PthReader, RefusesInstructionsAStateDictDoesNotNeed) {
  auto entries = good_file().entries();
  std::string& pickle = entries["nnmodel/data.pkl"];
  pickle.insert(2, "(ios\nsystem\n");  // INST
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("pickle instruction 0x69 at byte 3"));
}

TEST(PthReader, RefusesMissingShortAndOversizedData) {
  auto entries = good_file().entries();
  entries.erase("nnmodel/data/3");
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("'nnmodel/data/3' is missing"));
  entries = good_file().entries();
  entries["nnmodel/data/2"].resize(4092);
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("'fc2.weight' is truncated or damaged"));
  entries["nnmodel/data/2"].resize(1 << 20);
  EXPECT_THAT(refusal(zip_archive(entries)), HasSubstr("holds more than expected"));
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
  EXPECT_THAT(refusal(std::string("this is no zip")), HasSubstr("no zip archive"));
  EXPECT_THAT(refusal(std::string()), HasSubstr("no data.pkl"));  // an empty file is an empty archive
  EXPECT_THAT(refusal(whole.substr(0, whole.size() / 2)), HasSubstr("no zip archive, or truncated"));
  EXPECT_THAT(refusal(zip_archive({{"readme.txt", "hello"}})), HasSubstr("no data.pkl"));
  const TemporaryFolder folder;
  write_bytes(folder / "nnmodel.pth", std::string(5 << 20, 'x'));
  EXPECT_THAT(message_of([&] { read_model(folder / "nnmodel.pth"); }), HasSubstr("larger than 4 MiB"));
}

}  // namespace
}  // namespace gelslam::test
