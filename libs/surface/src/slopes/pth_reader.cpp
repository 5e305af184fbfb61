// Reads networks from PyTorch archives: those with the layers fc1 to fc4, or the 1x1 convolutions conv1 to
// conv4, with or without batch normalizations, and the network that GelSight distributes, which has three
// hidden layers of 64 neurons and returns components of a normal. Every tensor has to belong to the network,
// so that networks of other kinds are refused.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/zip_archive.hpp"
#include "gelslam/surface/model_file.hpp"
#include "slopes/pickle_reader.hpp"

namespace gelslam {
namespace surface::detail {
namespace {

static_assert(std::endian::native == std::endian::little, "the weights in the file are little-endian");

/// A state_dict has two entries per layer, and the optimizer of a checkpoint adds twice as many.
constexpr ZipLimits kLimits = {
    .entries = 256,
    .entry_bytes = sizeof(double) * static_cast<std::size_t>(WideNetwork::kWidest * WideNetwork::kWidest)};

/// The entries of a zip archive that torch.save wrote, in the one folder that holds data.pkl. They are found
/// by their names in that folder.
class TorchArchive {
 public:
  explicit TorchArchive(std::span<const unsigned char> file)
      : entries_(parse_zip({reinterpret_cast<const char*>(file.data()), file.size()}, "the file", kLimits)) {
    const std::string_view suffix = "/data.pkl";
    for (const ZipEntry& entry : entries_) {
      if (!entry.name.ends_with(suffix)) continue;
      if (!root_.empty()) throw Error("more than one data.pkl in the archive");
      root_ = entry.name.substr(0, entry.name.size() - suffix.size() + 1);
    }
    if (root_.empty()) throw Error("no data.pkl in the archive: this is not a PyTorch model");
  }

  const std::string* find(const std::string& name) const {
    const auto found = std::ranges::find(entries_, root_ + name, &ZipEntry::name);
    return found == entries_.end() ? nullptr : &found->contents;
  }
  const std::string& at(const std::string& name) const {
    const std::string* contents = find(name);
    if (contents == nullptr) throw Error("'" + root_ + name + "' is missing in the archive");
    return *contents;
  }

 private:
  std::vector<ZipEntry> entries_;
  std::string root_;  // the name of the folder, with a slash at the end
};

using Values = std::vector<double>;
using Shape = std::vector<std::int64_t>;

void check_finite(const Values& values, const std::string& name) {
  if (!std::ranges::all_of(values, [](double value) { return std::isfinite(static_cast<float>(value)); }))
    throw Error("'" + name + "' holds NaN or infinity");
}

struct NumberType {
  std::string_view storage_class;
  NpyType type;
  std::size_t bytes;
};
constexpr NumberType kNumberTypes[] = {{"HalfStorage", NpyType::float16, 2},
                                       {"FloatStorage", NpyType::float32, 4},
                                       {"DoubleStorage", NpyType::float64, 8}};

Values read_tensor(const TorchArchive& archive, const TensorEntry& entry) {
  const auto* const known = std::ranges::find(kNumberTypes, entry.storage_class, &NumberType::storage_class);
  if (known == std::end(kNumberTypes))
    throw Error("weights are torch." + entry.storage_class.substr(0, 80) +
                ", only float16, float32 and float64 are supported");
  const std::string& name = entry.name;
  std::int64_t elements = 1;
  for (std::size_t i = entry.shape.size(); i-- > 0;) {
    if (entry.shape[i] != 1 && entry.stride[i] != elements)
      throw Error("'" + name + "' is not stored contiguously");
    elements *= entry.shape[i];
  }
  const std::string& key = entry.storage_key;
  if (key.empty() || key.size() > 20 ||
      !std::all_of(key.begin(), key.end(), [](char c) { return c >= '0' && c <= '9'; }))
    throw Error("'" + name + "' has a bad storage key");
  const std::string& bytes = archive.at("data/" + key);
  const auto stored = static_cast<std::int64_t>(bytes.size() / known->bytes);
  if (entry.storage_elements != stored || bytes.size() % known->bytes != 0 || entry.storage_offset < 0 ||
      entry.storage_offset > stored - elements)
    throw Error("'" + name + "' is truncated or damaged");
  const auto first = static_cast<std::size_t>(entry.storage_offset),
             count = static_cast<std::size_t>(elements);
  const auto part = std::as_bytes(std::span(bytes)).subspan(first * known->bytes, count * known->bytes);
  Values values = NpyArray{known->type, {count}, {part.begin(), part.end()}}.to_doubles();
  check_finite(values, name);
  return values;
}

/// The tensors of an archive. Prefixes that wrapper modules add to the names are removed, and a 1x1
/// convolution gets the shape of the linear layer that it is equivalent to.
class StateDict {
 public:
  explicit StateDict(const TorchArchive& archive)
      : archive_(archive), entries_(read_state_dict_pickle(archive.at("data.pkl"))) {
    for (TensorEntry& entry : entries_) {
      for (const std::string_view prefix : {"module.", "model.", "module."})
        if (entry.name.starts_with(prefix)) entry.name.erase(0, prefix.size());
      if (entry.shape.size() != 4 || entry.shape[2] != 1 || entry.shape[3] != 1) continue;
      entry.shape.resize(2);
      entry.stride.resize(2);
    }
  }

  /// Returns the number of rows of the tensor with this name, or 0 if there is none that can be a weight.
  std::int64_t rows(const std::string& name) const {
    const auto found = std::ranges::find(entries_, name, &TensorEntry::name);
    return found != entries_.end() && !found->shape.empty() ? found->shape[0] : 0;
  }
  /// Returns the numbers of the tensor with this name. Throws Error if it is missing, or has another shape.
  Values take(const std::string& name, const Shape& shape) {
    const auto found = std::ranges::find(entries_, name, &TensorEntry::name);
    if (found == entries_.end() || found->shape != shape) refuse();
    ++taken_;
    return read_tensor(archive_, *found);
  }
  /// Ignores a tensor that the evaluation of the network does not need.
  void skip(const std::string& name) {
    taken_ += static_cast<std::size_t>(std::ranges::count(entries_, name, &TensorEntry::name));
  }
  void check_all_taken() const {
    if (taken_ != entries_.size()) refuse();
  }

 private:
  /// Returns a text for an error message, "its layers are fc1.weight 64x5, fc1.bias 64 ...", in which names
  /// from the file are shown only as far as they are harmless.
  [[noreturn]] void refuse() const {
    constexpr std::size_t shown = 8;
    std::string text;
    for (std::size_t k = 0; k < std::min(entries_.size(), shown); ++k) {
      text += (k == 0 ? "" : ", ") + entries_[k].name.substr(0, 80);
      for (std::size_t i = 0; i < entries_[k].shape.size(); ++i)
        text += (i == 0 ? " " : "x") + std::to_string(entries_[k].shape[i]);
    }
    if (entries_.size() > shown) text += " and " + std::to_string(entries_.size() - shown) + " more";
    throw Error("its layers are " + (text.empty() ? "none" : text) +
                "; read are fc1 to fc4 or conv1 to conv4 with biases, 5 inputs, 2 outputs and at most 256 "
                "neurons between, with or without batch normalizations bn1 to bn3");
  }

  const TorchArchive& archive_;
  std::vector<TensorEntry> entries_;
  std::size_t taken_ = 0;
};

/// A layer with weights row-major [out][in].
struct Layer {
  std::int64_t inputs, outputs;
  Values weight, bias;
};

/// Changes the weights and biases of a layer so that they include the batch normalization of its outputs.
void fold_normalization(StateDict& dict, const std::string& norm, Layer& layer) {
  constexpr double epsilon = 1e-5;  // the default of PyTorch; it is not stored in the file
  const Shape shape = {layer.outputs};
  const Values gain = dict.take(norm + ".weight", shape), shift = dict.take(norm + ".bias", shape),
               mean = dict.take(norm + ".running_mean", shape),
               variance = dict.take(norm + ".running_var", shape);
  dict.skip(norm + ".num_batches_tracked");
  for (std::size_t o = 0, weight = 0; o < gain.size(); ++o) {
    const double factor = gain[o] / std::sqrt(variance[o] + epsilon);
    layer.bias[o] = (layer.bias[o] - mean[o]) * factor + shift[o];
    for (std::int64_t i = 0; i < layer.inputs; ++i) layer.weight[weight++] *= factor;
  }
  check_finite(layer.weight, norm);
  check_finite(layer.bias, norm);
}

using Layers = std::array<Layer, NetworkShape::kLayers>;

// The correction of the slopes (gx, gy) that the network of GelSight reads, a 2x2 matrix. It is the inverse
// of (1.155, 0.05; 0.06, 0.91), the mean factor between read and true slopes in presses of balls on four real
// sensors. There, the first element was 0.98 to 1.27 and the last 0.70 to 1.05.
constexpr std::array<float, 4> kMakersSlopes = {0.868F, -0.048F, -0.057F, 1.102F};

/// Returns a model with the given layers. If they are narrower than the sizes that can be evaluated, neurons
/// with zero weights are added.
GradientModel model_of(const Layers& layers, bool gives_normals) {
  NetworkShape shape = GradientModel::kShape;
  bool wide = false;
  for (std::size_t l = 1; l < shape.kLayers; ++l) wide |= layers[l].inputs > shape.sizes[l];
  for (std::size_t l = 1; wide && l < shape.kLayers; ++l)
    shape.sizes[l] = static_cast<int>((layers[l].inputs + 7) / 8 * 8);
  std::vector<float> numbers(shape.start(shape.kLayers));
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const auto to_float = [](double value) { return static_cast<float>(value); };
    auto row = numbers.begin() + static_cast<std::ptrdiff_t>(shape.start(l));
    std::ranges::transform(layers[l].bias, row + static_cast<std::ptrdiff_t>(shape.weights(l)), to_float);
    for (auto from = layers[l].weight.begin(); from != layers[l].weight.end();
         from += layers[l].inputs, row += shape.sizes[l])
      std::transform(from, from + layers[l].inputs, row, to_float);
  }
  GradientModel model;
  if (wide)
    model.wide = {shape, gives_normals, std::move(numbers)};
  else
    std::ranges::copy(numbers, model.numbers.begin());
  return model;
}

GradientModel read_archive(std::span<const unsigned char> file) {
  const TorchArchive archive(file);
  const std::string* order = archive.find("byteorder");  // written by newer PyTorch only
  if (order != nullptr && *order != "little") throw Error("its numbers are not little-endian");
  StateDict dict(archive);
  const std::string kind = dict.rows("conv1.weight") > 0 ? "conv" : "fc";
  Layers layers;
  bool makers = kind == "fc";  // GelSight's network is recognized by its sizes
  std::int64_t inputs = GradientModel::kShape.sizes.front();
  for (std::size_t l = 0; l < layers.size(); inputs = layers[l++].outputs) {
    const std::string number = std::to_string(l + 1), name = kind + number, norm = "bn" + number;
    const bool last = l + 1 == layers.size();
    const std::int64_t outputs =
        last ? 2 : std::clamp<std::int64_t>(dict.rows(name + ".weight"), 1, WideNetwork::kWidest);
    layers[l] = {inputs, outputs, dict.take(name + ".weight", {outputs, inputs}),
                 dict.take(name + ".bias", {outputs})};
    const bool normalized = dict.rows(norm + ".running_var") > 0;
    if (normalized) fold_normalization(dict, norm, layers[l]);
    makers = makers && !normalized && (last || outputs == 64);
  }
  dict.check_all_taken();
  if (!makers) return model_of(layers, false);
  for (std::size_t weight = 0; weight < layers[0].weight.size(); weight += 5)
    std::swap(layers[0].weight[weight + 3], layers[0].weight[weight + 4]);  // its inputs are row and column
  GradientModel model = model_of(layers, true);
  model.slope_matrix = kMakersSlopes;
  return model;
}

}  // namespace
}  // namespace surface::detail

GradientModel parse_pth_model(std::span<const unsigned char> file, const std::string& name) {
  try {
    return surface::detail::read_archive(file);
  } catch (const Error& error) {
    throw Error("gradient model '" + name + "': " + error.what());
  }
}

}  // namespace gelslam
