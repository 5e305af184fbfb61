#include "pth_file.hpp"

#include <zip.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
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

/// Protocol 2 has long texts and globals by name; 4 and 5 short ones, and globals by the two texts before
/// them. Every text is remembered, as Python does it.
class Writer {
 public:
  explicit Writer(int protocol) : protocol_(protocol) {
    text = {'\x80', static_cast<char>(protocol)};
    if (protocol >= 4) text += join({"\x95", std::string(8, '\x11')});
  }
  std::string unicode(const std::string& word) const {
    if (protocol_ >= 4)
      return join({"\x8c", little_endian(static_cast<std::uint32_t>(word.size()), 1), word, "\x94"});
    return join({"X", little_endian(static_cast<std::uint32_t>(word.size()), 4), word});
  }
  std::string global(const std::string& module_and_name) const {
    const std::size_t blank = module_and_name.find(' ');
    const std::string module = module_and_name.substr(0, blank), name = module_and_name.substr(blank + 1);
    if (protocol_ >= 4) return join({unicode(module), unicode(name), "\x93\x94"});
    return join({"c", module, "\n", name, "\n"});
  }
  std::string ordered_dict() const { return join({global("collections OrderedDict"), ")R"}); }

  std::string text;

 private:
  int protocol_;
};

std::string integer(int value) {
  const auto bits = static_cast<std::uint32_t>(value);
  if (value >= 0 && value < 256) return join({"K", little_endian(bits, 1)});
  if (value >= 0 && value < 65536) return join({"M", little_endian(bits, 2)});
  return join({"J", little_endian(bits, 4)});
}

std::string tuple_of(const std::vector<int>& values) {
  std::string text;
  for (const int value : values) text += integer(value);
  if (values.size() > 3) return join({"(", text, "t"});
  return text + (values.empty() ? ')' : static_cast<char>(0x84 + values.size()));
}

template <class Number>
std::string bytes_of(const std::vector<float>& values) {
  const std::vector<Number> numbers(values.begin(), values.end());
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

struct Tensor {
  std::string name;
  std::vector<int> shape;
  std::vector<float> values;
  std::string storage_class;
};

std::vector<Tensor> tensors_of(const PthFile& file) {
  std::vector<Tensor> tensors;
  for (std::size_t i = 0; i < file.layers.size(); ++i) {
    const PthLayer& layer = file.layers[i];
    const std::string number = std::to_string(i + 1), name = file.prefix + file.layer_name + number,
                      norm = file.prefix + "bn" + number;
    std::vector<int> shape = {layer.outputs, layer.inputs};
    if (file.layer_name == "conv") shape.insert(shape.end(), {1, 1});
    tensors.push_back({name + ".weight", shape, layer.weight, file.storage_class});
    tensors.push_back({name + ".bias", {layer.outputs}, layer.bias, file.storage_class});
    if (i >= file.norms.size()) continue;
    const PthNorm& n = file.norms[i];
    for (const auto& [part, values] : {std::pair{".weight", &n.gain},
                                       {".bias", &n.shift},
                                       {".running_mean", &n.mean},
                                       {".running_var", &n.variance}})
      tensors.push_back({norm + part, {layer.outputs}, *values, file.storage_class});
    tensors.push_back({norm + ".num_batches_tracked", {}, {7}, "torch LongStorage"});
  }
  return tensors;
}

}  // namespace

std::string PthFile::pickle() const {
  Writer writer(protocol);
  std::string& text = writer.text;
  const auto unicode = [&](const std::string& word) { return writer.unicode(word); };
  if (checkpoint) text += join({"}(", unicode("epoch"), integer(31), unicode(entry)});
  text += join({writer.ordered_dict(), protocol < 4 ? std::string("q\0", 2) : "\x94", "("});
  int key = 0;
  for (const Tensor& tensor : tensors_of(*this)) {
    std::vector<int> stride(tensor.shape.size(), 1);
    for (std::size_t i = stride.size(); i-- > 1;) stride[i - 1] = stride[i] * tensor.shape[i];
    text += join({unicode(tensor.name), writer.global(rebuild_function), "((", unicode("storage"),
                  writer.global(tensor.storage_class), unicode(std::to_string(key++)), unicode("cpu"),
                  integer(static_cast<int>(tensor.values.size())), "tQ", integer(storage_offset),
                  tuple_of(tensor.shape), tuple_of(stride), "\x89", writer.ordered_dict(), "tR"});
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
  for (const Tensor& tensor : tensors_of(*this))
    result[join({root, "/data/", std::to_string(key++)})] =
        tensor.storage_class == "torch DoubleStorage" ? bytes_of<double>(tensor.values)
        : tensor.storage_class == "torch LongStorage" ? bytes_of<std::int64_t>(tensor.values)
        : tensor.storage_class == "torch HalfStorage" ? bytes_of<Eigen::half>(tensor.values)
                                                      : bytes_of<float>(tensor.values);
  for (const auto& [name, contents] : more_entries) result[join({root, "/", name})] = contents;
  return result;
}

std::vector<double> naive_outputs(const PthFile& file, std::vector<double> values) {
  for (std::size_t l = 0; l < file.layers.size(); ++l) {
    const PthLayer& layer = file.layers[l];
    std::vector<double> next;
    for (std::size_t o = 0; o < layer.bias.size(); ++o) {
      auto sum = static_cast<double>(layer.bias[o]);
      for (std::size_t i = 0; i < values.size(); ++i)
        sum += static_cast<double>(layer.weight[o * values.size() + i]) * values[i];
      const auto at = [&](const std::vector<float>& numbers) { return static_cast<double>(numbers[o]); };
      if (l < file.norms.size()) {
        const PthNorm& n = file.norms[l];
        sum = (sum - at(n.mean)) / std::sqrt(at(n.variance) + 1e-5) * at(n.gain) + at(n.shift);
      }
      next.push_back(l + 1 < file.layers.size() ? std::max(sum, 0.0) : sum);
    }
    values = std::move(next);
  }
  return values;
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

std::vector<PthNorm> random_norms(std::uint64_t seed, const std::vector<PthLayer>& layers) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> any(-0.5F, 0.5F), positive(0.1F, 2.0F);
  std::vector<PthNorm> norms;
  for (std::size_t i = 0; i + 1 < layers.size(); ++i) {
    PthNorm& norm = norms.emplace_back();
    for (int k = 0; k < layers[i].outputs; ++k) {
      norm.gain.push_back(positive(random));
      norm.shift.push_back(any(random));
      norm.mean.push_back(any(random));
      norm.variance.push_back(positive(random));
    }
  }
  return norms;
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
    layers.push_back({GradientModel::kShape.sizes[l],
                      GradientModel::kShape.sizes[l + 1],
                      {weight.begin(), weight.end()},
                      {bias.begin(), bias.end()}});
  }
  return layers;
}

}  // namespace gelslam::test
