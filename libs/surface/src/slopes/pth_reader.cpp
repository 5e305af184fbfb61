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

std::string shape_text(const std::vector<std::int64_t>& shape) {
  std::string text = "[";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ",") + std::to_string(shape[i]);
  return text + "]";
}

void read_tensor(zip_t* archive, const std::string& root, const std::vector<TensorEntry>& entries,
                 const std::string& name, const std::vector<std::int64_t>& shape, std::span<float> values) {
  const auto has_name = [&](const TensorEntry& entry) { return entry.name == name; };
  if (std::count_if(entries.begin(), entries.end(), has_name) != 1) {
    throw Error("it does not hold exactly one '" + name + "' (expected fc1..fc4 .weight and .bias)");
  }
  const TensorEntry& entry = *std::find_if(entries.begin(), entries.end(), has_name);
  if (entry.shape != shape) {
    throw Error("'" + name + "' is " + shape_text(entry.shape) + ", expected " + shape_text(shape) +
                " (a 5-32-32-32-2 network)");
  }
  std::int64_t elements = 1;
  for (std::size_t i = shape.size(); i-- > 0;) {
    if (entry.stride[i] != elements) throw Error("'" + name + "' is not stored contiguously");
    elements *= shape[i];
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

GradientModel read_archive(std::span<const unsigned char> file) {
  const Archive archive = open_archive(file);
  const std::string root = find_root(archive.get());
  check_byte_order(archive.get(), root);
  const std::vector<TensorEntry> entries =
      read_state_dict_pickle(read_entry(archive.get(), root + "/data.pkl"));
  if (entries.size() != 8) {
    throw Error("it holds " + std::to_string(entries.size()) +
                " tensors, expected 8 (fc1..fc4 .weight and .bias)");
  }
  GradientModel model;
  for (std::size_t l = 0; l < GradientModel::kLayers; ++l) {
    const std::string name = "fc" + std::to_string(l + 1);
    const int inputs = GradientModel::kSizes[l], outputs = GradientModel::kSizes[l + 1];
    read_tensor(archive.get(), root, entries, name + ".weight", {outputs, inputs}, model.weight(l));
    read_tensor(archive.get(), root, entries, name + ".bias", {outputs}, model.bias(l));
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
