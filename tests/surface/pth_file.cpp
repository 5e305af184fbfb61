#include "pth_file.hpp"

#include <zip.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <stdexcept>
#include <string_view>

namespace gelslam::test {
namespace {

std::string little_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>((value >> (8 * i)) & 0xff));
  return text;
}

std::string join(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text.append(part);
  return text;
}

std::string unicode(const std::string& text) {
  return join({"X", little_endian(static_cast<std::uint32_t>(text.size()), 4), text});
}

std::string integer(int value) {
  const auto bits = static_cast<std::uint32_t>(value);
  if (value >= 0 && value < 256) return join({"K", little_endian(bits, 1)});
  if (value >= 0 && value < 65536) return join({"M", little_endian(bits, 2)});
  return join({"J", little_endian(bits, 4)});
}

std::string global(std::string module_and_name) {
  module_and_name.replace(module_and_name.find(' '), 1, "\n");
  return join({"c", module_and_name, "\n"});
}

std::string tuple_of(const std::vector<int>& values) {
  std::string text;
  if (values.empty()) return ")";
  for (const int value : values) text += integer(value);
  text += values.size() == 1 ? '\x85' : '\x86';
  return text;
}

std::string float_bytes(const std::vector<float>& values) {
  std::string bytes(values.size() * sizeof(float), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

const std::string kOrderedDict = "ccollections\nOrderedDict\n)R";

}  // namespace

std::string PthFile::pickle() const {
  std::string text = "\x80\x02";
  if (checkpoint) text += join({"}(", unicode("epoch"), integer(31), unicode(entry)});
  text += join({kOrderedDict, "q", std::string(1, '\0'), "("});
  int key = 0;
  const auto add_tensor = [&](const std::string& name, const std::vector<int>& shape,
                              const std::vector<int>& stride, std::size_t count, const std::string& storage) {
    text += join({unicode(name), global(rebuild_function), "((", unicode("storage"), global(storage),
                  unicode(std::to_string(key++)), unicode("cpu"), integer(static_cast<int>(count)), "tQ",
                  integer(storage_offset), tuple_of(shape), tuple_of(stride), "\x89", kOrderedDict, "tR"});
  };
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::string name = join({"fc", std::to_string(i + 1)});
    add_tensor(join({name, ".weight"}), {layers[i].outputs, layers[i].inputs}, {layers[i].inputs, 1},
               layers[i].weight.size(), storage_class);
    add_tensor(join({name, ".bias"}), {layers[i].outputs}, {1}, layers[i].bias.size(), storage_class);
    if (!batch_norm || i + 1 == layers.size()) continue;
    const std::string norm = join({"bn", std::to_string(i + 1)});
    add_tensor(join({norm, ".running_mean"}), {layers[i].outputs}, {1}, layers[i].bias.size(), storage_class);
    add_tensor(join({norm, ".num_batches_tracked"}), {}, {}, 1, "torch LongStorage");
  }
  text += "u";
  // The state is {'_metadata': {'version': 1}}.
  if (with_metadata) text += join({"}", unicode("_metadata"), "}", unicode("version"), integer(1), "ssb"});
  // {'state': {0: {}}, 'param_groups': [{'lr': 0.01, 'foreach': None, 'params': [0, 1]}]}
  if (checkpoint)
    text +=
        join({unicode("optimizer"), "}(", unicode("state"), "}", integer(0), "}s", unicode("param_groups"),
              "]}(", unicode("lr"), "G", std::string("\x3f\x84\x7a\xe1\x47\xae\x14\x7b"), unicode("foreach"),
              "N", unicode("params"), "](", integer(0), integer(1), "euauu"});
  text += '.';
  return text;
}

std::map<std::string, std::string> PthFile::entries() const {
  std::map<std::string, std::string> result;
  result[join({root, "/data.pkl"})] = pickle();
  int key = 0;
  for (const PthLayer& layer : layers) {
    result[join({root, "/data/", std::to_string(key++)})] = float_bytes(layer.weight);
    result[join({root, "/data/", std::to_string(key++)})] = float_bytes(layer.bias);
  }
  for (const auto& [name, contents] : more_entries) result[join({root, "/", name})] = contents;
  return result;
}

std::string zip_archive(const std::map<std::string, std::string>& entries) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, &error);
  zip_t* archive = zip_open_from_source(target, ZIP_TRUNCATE, &error);
  if (archive == nullptr) throw std::runtime_error("zip_open_from_source");
  zip_source_keep(target);
  for (const auto& [name, contents] : entries) {
    zip_source_t* source = zip_source_buffer(archive, contents.data(), contents.size(), 0);
    const zip_int64_t index = zip_file_add(archive, name.c_str(), source, 0);
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), ZIP_CM_STORE,
                             0);  // as torch.save does
  }
  if (zip_close(archive) != 0) throw std::runtime_error("zip_close");
  zip_stat_t info;
  zip_source_stat(target, &info);
  std::string bytes(info.size, '\0');
  zip_source_open(target);
  zip_source_read(target, bytes.data(), bytes.size());
  zip_source_close(target);
  zip_source_free(target);
  return bytes;
}

std::vector<PthLayer> random_layers(std::uint64_t seed, const std::vector<int>& sizes) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] {
    return static_cast<float>(static_cast<double>(random() >> 11) * 0x1p-53 * 0.6 - 0.3);
  };
  std::vector<PthLayer> layers;
  for (std::size_t i = 0; i + 1 < sizes.size(); ++i) {
    PthLayer layer{sizes[i], sizes[i + 1], {}, {}};
    for (int k = 0; k < layer.inputs * layer.outputs; ++k) layer.weight.push_back(uniform());
    for (int k = 0; k < layer.outputs; ++k) layer.bias.push_back(uniform());
    layers.push_back(layer);
  }
  return layers;
}

GradientModel random_model(std::uint64_t seed) {
  GradientModel model;
  const std::vector<PthLayer> layers = random_layers(seed);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    std::ranges::copy(layers[l].weight, model.weight(l).begin());
    std::ranges::copy(layers[l].bias, model.bias(l).begin());
  }
  return model;
}

std::vector<PthLayer> random_maker_layers(std::uint64_t seed) {
  std::vector<PthLayer> layers = random_layers(seed, {5, 64, 64, 64, 2});
  for (float& weight : layers.back().weight) weight *= 0.4F;
  layers.back().bias = {0.5F, -0.3F};
  return layers;
}

std::vector<PthLayer> layers_of(const GradientModel& model) {
  std::vector<PthLayer> layers;
  for (std::size_t l = 0; l < GradientModel::kLayers; ++l) {
    const auto weight = model.weight(l), bias = model.bias(l);
    layers.push_back({GradientModel::kSizes[l],
                      GradientModel::kSizes[l + 1],
                      {weight.begin(), weight.end()},
                      {bias.begin(), bias.end()}});
  }
  return layers;
}

}  // namespace gelslam::test
