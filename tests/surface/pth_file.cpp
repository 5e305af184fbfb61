#include "pth_file.hpp"

#include <zip.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>

#include "../support/run_program.hpp"

namespace gelslam::test {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PthLayer, inputs, outputs, weight, bias)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PthNorm, weight, bias, running_mean, running_var)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PthFile, layers, norms, layer_name, prefix, protocol, storage_class,
                                   rebuild_function, storage_offset, checkpoint, entry, with_metadata)

std::map<std::string, std::string> PthFile::entries() const {
  const TemporaryFolder folder;
  write_bytes(folder / "spec.json", nlohmann::json(*this).dump());
  const fs::path files = folder / "files";
  const ProgramResult python =
      run_program("/usr/bin/python3", {GELSLAM_WRITE_PTH, folder / "spec.json", files});
  EXPECT_EQ(python.exit_code, 0) << python.err;
  std::map<std::string, std::string> result;
  for (const fs::path& file : fs::recursive_directory_iterator(files))
    if (fs::is_regular_file(file)) result[root + "/" + fs::relative(file, files).string()] = read_bytes(file);
  for (const auto& [name, contents] : more_entries) result[root + "/" + name] = contents;
  return result;
}

std::vector<double> naive_angles(const PthFile& file, std::vector<double> values) {
  if (file.gives_normals) std::swap(values[3], values[4]);
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
        sum = (sum - at(n.running_mean)) / std::sqrt(at(n.running_var) + 1e-5) * at(n.weight) + at(n.bias);
      }
      next.push_back(l + 1 < file.layers.size() ? std::max(sum, 0.0) : sum);
    }
    values = std::move(next);
  }
  if (!file.gives_normals) return values;
  const double z = std::sqrt(1 - values[0] * values[0] - values[1] * values[1]);
  return {std::atan(values[0] / z), std::atan(values[1] / z)};
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
      norm.weight.push_back(positive(random));
      norm.bias.push_back(any(random));
      norm.running_mean.push_back(any(random));
      norm.running_var.push_back(positive(random));
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

PthFile makers_file(std::uint64_t seed) {
  PthFile file;
  file.layers = random_layers(seed, {5, 64, 64, 64, 2});
  for (float& weight : file.layers.back().weight) weight *= 0.4F;
  file.layers.back().bias = {0.5F, -0.3F};
  file.checkpoint = file.gives_normals = true;
  return file;
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
