#include <zip.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"
#include "slopes/pickle_reader.hpp"

namespace gelslam {
namespace surface::detail {
namespace {

static_assert(std::endian::native == std::endian::little, "the weights in the file are little-endian");

using Bytes = std::vector<unsigned char>;

struct ArchiveCloser {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct EntryCloser {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};
using Archive = std::unique_ptr<zip_t, ArchiveCloser>;

Archive open_archive(std::span<const unsigned char> file) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(file.data(), file.size(), 0, &error);
  zip_t* archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  if (archive == nullptr) {
    zip_source_free(source);
    zip_error_fini(&error);
    throw Error("not a zip archive, or truncated (PyTorch >= 1.6 saves zip archives)");
  }
  return Archive(archive);
}

Bytes read_entry(zip_t* archive, const std::string& name) {
  zip_stat_t info;
  if (zip_stat(archive, name.c_str(), 0, &info) != 0 || (info.valid & ZIP_STAT_SIZE) == 0) {
    throw Error("'" + name + "' is missing in the archive");
  }
  if (info.size > kMaxEntryBytes) throw Error("'" + name + "' is too large for a gradient model");
  const std::unique_ptr<zip_file_t, EntryCloser> entry(zip_fopen(archive, name.c_str(), 0));
  if (entry == nullptr) throw Error("'" + name + "' cannot be read");
  Bytes bytes(info.size + 1);  // one more: the end must be reached for libzip to check the CRC
  std::size_t size = 0;
  while (size < bytes.size()) {
    const zip_int64_t count = zip_fread(entry.get(), bytes.data() + size, bytes.size() - size);
    if (count < 0) throw Error("'" + name + "' is damaged");
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size != info.size) throw Error("'" + name + "' is damaged (length)");
  bytes.resize(size);
  return bytes;
}

// The archive's one folder that holds data.pkl.
std::string find_root(zip_t* archive) {
  const std::string_view suffix = "/data.pkl";
  const zip_int64_t count = zip_get_num_entries(archive, 0);
  std::string root;
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(archive, static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    if (name == nullptr || !std::string_view(name).ends_with(suffix)) continue;
    if (!root.empty()) throw Error("more than one data.pkl in the archive");
    root = std::string(name, std::strlen(name) - suffix.size());
  }
  if (root.empty()) throw Error("no data.pkl in the archive: this is not a PyTorch model");
  return root;
}

void check_byte_order(zip_t* archive, const std::string& root) {
  const std::string name = root + "/byteorder";
  if (zip_name_locate(archive, name.c_str(), 0) < 0) return;  // written by newer PyTorch only
  const Bytes order = read_entry(archive, name);
  if (std::string_view(reinterpret_cast<const char*>(order.data()), order.size()) != "little") {
    throw Error("its numbers are not little-endian");
  }
}

void read_tensor(zip_t* archive, const std::string& root, const std::vector<TensorEntry>& entries,
                 const std::string& name, std::span<float> values) {
  const TensorEntry& entry = *std::ranges::find(entries, name, &TensorEntry::name);
  if (entry.storage_class != "FloatStorage")
    throw Error("weights are torch." + printable(entry.storage_class) +
                ", only float32 (torch.FloatStorage) is supported");
  std::int64_t elements = 1;
  for (std::size_t i = entry.shape.size(); i-- > 0;) {
    if (entry.stride[i] != elements) throw Error("'" + name + "' is not stored contiguously");
    elements *= entry.shape[i];
  }
  const std::string& key = entry.storage_key;
  if (key.empty() || key.size() > 20 ||
      !std::all_of(key.begin(), key.end(), [](char c) { return c >= '0' && c <= '9'; })) {
    throw Error("'" + name + "' has a bad storage key");
  }
  const Bytes bytes = read_entry(archive, root + "/data/" + key);
  const auto stored = static_cast<std::int64_t>(bytes.size() / sizeof(float));
  if (entry.storage_elements != stored || bytes.size() % sizeof(float) != 0 || entry.storage_offset < 0 ||
      entry.storage_offset > stored - elements) {
    throw Error("'" + name + "' is truncated or damaged");
  }
  std::memcpy(values.data(), bytes.data() + static_cast<std::size_t>(entry.storage_offset) * sizeof(float),
              values.size_bytes());
  if (!std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); })) {
    throw Error("'" + name + "' holds NaN or infinity");
  }
}

using Sizes = std::array<int, 5>;

std::string sizes_text(const Sizes& sizes) {
  std::string text;
  for (const int size : sizes) text += (text.empty() ? "" : "-") + std::to_string(size);
  return text;
}

/// "fc1.weight 64x5, fc1.bias 64": what may be shown of hostile names.
std::string layers_text(const std::vector<TensorEntry>& entries) {
  constexpr std::size_t shown = 8;
  std::string text;
  for (std::size_t k = 0; k < std::min(entries.size(), shown); ++k) {
    text += (k == 0 ? "" : ", ") + printable(entries[k].name);
    for (std::size_t i = 0; i < entries[k].shape.size(); ++i)
      text += (i == 0 ? " " : "x") + std::to_string(entries[k].shape[i]);
  }
  if (entries.size() > shown) text += " and " + std::to_string(entries.size() - shown) + " more";
  return text.empty() ? "none" : text;
}

/// Exactly one of each weight and bias, in any order, and nothing else.
bool fits(const std::vector<TensorEntry>& entries, const Sizes& sizes) {
  const auto count = [&](const std::string& name, const std::vector<std::int64_t>& shape) {
    return std::ranges::count_if(
        entries, [&](const TensorEntry& entry) { return entry.name == name && entry.shape == shape; });
  };
  bool all = entries.size() == 8;
  for (std::size_t l = 0; l < 4; ++l) {
    const std::string name = "fc" + std::to_string(l + 1);
    all = all && count(name + ".weight", {sizes[l + 1], sizes[l]}) == 1 &&
          count(name + ".bias", {sizes[l + 1]}) == 1;
  }
  return all;
}

template <int Hidden>
void read_layers(zip_t* archive, const std::string& root, const std::vector<TensorEntry>& entries,
                 PixelNetwork<Hidden>& network) {
  for (std::size_t l = 0; l < network.kLayers; ++l) {
    const std::string name = "fc" + std::to_string(l + 1);
    read_tensor(archive, root, entries, name + ".weight", network.weight(l));
    read_tensor(archive, root, entries, name + ".bias", network.bias(l));
  }
}

GradientModel read_archive(std::span<const unsigned char> file) {
  const Archive archive = open_archive(file);
  const std::string root = find_root(archive.get());
  check_byte_order(archive.get(), root);
  const std::vector<TensorEntry> entries =
      read_state_dict_pickle(read_entry(archive.get(), root + "/data.pkl"));
  GradientModel model;
  if (fits(entries, MakerNetwork::kSizes)) {
    read_layers(archive.get(), root, entries, model.maker.emplace());
    for (std::size_t weight = 0; weight < model.maker->weight(0).size(); ++weight)
      if (weight % 5 >= 3) model.maker->weight(0)[weight] = 0.0F;  // the positions, of which it sees zeros
  } else if (fits(entries, GradientModel::kSizes)) {
    read_layers(archive.get(), root, entries, static_cast<PixelNetwork<32>&>(model));
  } else {
    throw Error("its layers are " + layers_text(entries) + "; read are fc1 to fc4 with biases of " +
                sizes_text(GradientModel::kSizes) + " (nnmodel.pth) and " + sizes_text(MakerNetwork::kSizes) +
                " (nnmini.pt)");
  }
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
