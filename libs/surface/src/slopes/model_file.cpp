#include "gelslam/surface/model_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormatName = "gelslam gradient model";
constexpr int kFormatVersion = 1;

const Json& member(const Json& object, const char* name) {
  const auto found = object.is_object() ? object.find(name) : object.end();
  if (!object.is_object() || found == object.end()) throw Error(std::string("'") + name + "' is missing");
  return *found;
}

double number(const Json& value, const char* name, double min, double max) {
  const double x = value.is_number() ? value.get<double>() : std::nan("");
  if (!(x >= min && x <= max)) throw Error(std::string("'") + name + "' holds no good number");
  return x;
}

int whole_number(const Json& object, const char* name, int min, int max) {
  const Json& value = member(object, name);
  if (!value.is_number_integer()) throw Error(std::string("'") + name + "' is no whole number");
  return static_cast<int>(number(value, name, min, max));
}

std::vector<float> numbers(const Json& object, const char* name, std::size_t count) {
  const Json& array = member(object, name);
  if (!array.is_array() || array.size() != count)
    throw Error(std::string("'") + name + "' does not hold " + std::to_string(count) + " numbers");
  std::vector<float> values;
  values.reserve(count);
  for (const Json& value : array)
    values.push_back(static_cast<float>(
        number(value, name, std::numeric_limits<float>::lowest(), std::numeric_limits<float>::max())));
  return values;
}

NetworkShape parse_shape(const Json& layers) {
  NetworkShape shape = GradientModel::kShape;
  for (std::size_t l = 0; l + 1 < NetworkShape::kLayers; ++l) {
    const Json& bias = member(layers[l], "bias");
    if (!bias.is_array() || bias.empty() || bias.size() > WideNetwork::kWidest || bias.size() % 8 != 0)
      throw Error("a layer of 'layers' has not 8, 16 ... 256 neurons");
    shape.sizes[l + 1] = static_cast<int>(bias.size());
  }
  return shape;
}

GradientModel parse_layers(const Json& layers, bool gives_normals) {
  if (!layers.is_array() || layers.size() != NetworkShape::kLayers)
    throw Error("'layers' does not hold 4 layers");
  const NetworkShape shape = parse_shape(layers);
  std::vector<float> all;
  for (std::size_t l = 0; l < NetworkShape::kLayers; ++l) {
    std::ranges::copy(numbers(layers[l], "weight", shape.weights(l)), std::back_inserter(all));
    std::ranges::copy(numbers(layers[l], "bias", shape.outputs(l)), std::back_inserter(all));
  }
  GradientModel model;
  if (gives_normals || shape != GradientModel::kShape)
    model.wide = {shape, gives_normals, std::move(all)};
  else
    std::ranges::copy(all, model.numbers.begin());
  return model;
}

SensorOptics parse_optics(const Json& json) {
  const auto finite = [&](const Json& value, const char* name) { return number(value, name, -1e6, 1e6); };
  const auto pair = [&](const char* name) {
    const Json& values = member(json, name);
    if (!values.is_array() || values.size() != 2) throw Error(std::string("'") + name + "' is no pair");
    return std::array{finite(values[0], name), finite(values[1], name)};
  };
  SensorOptics optics;
  optics.lens_k1 = finite(member(json, "lens_k1"), "lens_k1");
  optics.lens_center_px = pair("lens_center_px");
  optics.pixel_aspect = finite(member(json, "pixel_aspect"), "pixel_aspect");
  optics.camera_distance_mm = finite(member(json, "camera_distance_mm"), "camera_distance_mm");
  optics.gel_dome_per_mm = pair("gel_dome_per_mm");
  return optics;
}

CalibrationRecord parse_record(const Json& json) {
  CalibrationRecord record;
  record.width_px = whole_number(json, "width_px", 1, 100'000);
  record.height_px = whole_number(json, "height_px", 1, 100'000);
  record.pixel_pitch_mm = number(member(json, "pixel_pitch_mm"), "pixel_pitch_mm", 1e-4, 10.0);
  record.presses = whole_number(json, "presses", 0, 1'000'000);
  const Json& diameters = member(json, "diameters_mm");
  if (!diameters.is_array() || diameters.size() > 1000) throw Error("'diameters_mm' is no list");
  for (const Json& diameter : diameters)
    record.diameters_mm.push_back(number(diameter, "diameters_mm", 0.0, 1e4));
  const Json& seed = member(json, "seed");
  if (!seed.is_number_unsigned()) throw Error("'seed' is no whole number");
  record.seed = seed.get<std::uint64_t>();
  const std::vector<float> cells =
      numbers(json, "background_bgr", static_cast<std::size_t>(3 * kBackgroundGrid.area()));
  record.background_cells.create(kBackgroundGrid);
  for (int k = 0; k < kBackgroundGrid.area(); ++k)
    for (int c = 0; c < 3; ++c)
      record.background_cells(k / kBackgroundGrid.width, k % kBackgroundGrid.width)[c] =
          cells[static_cast<std::size_t>(3 * k + c)];
  return record;
}

ModelFile parse_text(std::string_view text) {
  if (text.size() > kMaxModelBytes) throw Error("it is larger than 4 MiB, this is no gradient model");
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw Error("it is damaged (no JSON)");
  const Json& format = member(json, "format");
  if (!format.is_string() || format.get_ref<const std::string&>() != kFormatName)
    throw Error(std::string("its 'format' is not \"") + kFormatName + "\"");
  if (whole_number(json, "version", 1, 1'000'000) > kFormatVersion)
    throw Error("it was written by a newer gelslam; update this one");
  ModelFile file;
  file.model = parse_layers(member(json, "layers"), json.value("gives_normals", false));
  if (json.contains("slope_matrix"))
    std::ranges::copy(numbers(json, "slope_matrix", 4), file.model.slope_matrix.begin());
  constexpr auto kCells = static_cast<std::size_t>(GradientModel::kSigmaColumns * GradientModel::kSigmaRows);
  if (json.contains("slope_sigma_rad")) {
    file.model.sigma_rad = numbers(json, "slope_sigma_rad", kCells);
    for (const float sigma : file.model.sigma_rad)
      if (!(sigma >= 1e-4F && sigma <= 10.0F)) throw Error("'slope_sigma_rad' holds no good number");
  }
  if (json.contains("optics")) file.model.optics = parse_optics(json["optics"]);
  if (json.contains("calibration")) {
    file.record = parse_record(json["calibration"]);
    file.model.bare_gel_bgr = mean_color(file.record->background_cells);
  }
  if (json.contains("bare_gel_bgr")) {
    std::ranges::copy(numbers(json, "bare_gel_bgr", 3), file.model.bare_gel_bgr.emplace().begin());
    for (const float level : *file.model.bare_gel_bgr)
      if (!(level >= 0 && level <= 255)) throw Error("'bare_gel_bgr' holds no gray levels");
  }
  return file;
}

Json to_json(const CalibrationRecord& record) {
  Json cells = Json::array();
  for (const cv::Vec3f& cell : record.background_cells)
    for (int c = 0; c < 3; ++c) cells.push_back(std::round(static_cast<double>(cell[c]) * 100.0) / 100.0);
  return {{"width_px", record.width_px},
          {"height_px", record.height_px},
          {"pixel_pitch_mm", record.pixel_pitch_mm},
          {"presses", record.presses},
          {"diameters_mm", record.diameters_mm},
          {"seed", record.seed},
          {"background_bgr", std::move(cells)}};
}

}  // namespace

std::array<float, 3> mean_color(const cv::Mat& bgr) {
  const cv::Scalar mean = cv::mean(bgr);
  return {static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2])};
}

cv::Mat3f background_cells(const cv::Mat3b& background) {
  cv::Mat3f numbers, cells;
  background.convertTo(numbers, CV_32F);
  cv::resize(numbers, cells, kBackgroundGrid, 0.0, 0.0, cv::INTER_AREA);
  return cells;
}

ModelFile parse_model_file(std::span<const unsigned char> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("PK")) return {parse_pth_model(bytes, name), std::nullopt};
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || text[first] != '{')
    throw Error("gradient model '" + name +
                "' is neither an nnmodel.pth or nnmini.pt (zip archive) nor a gelslam model (JSON)");
  try {
    return parse_text(text);
  } catch (const Error& error) {
    throw Error("gradient model '" + name + "': " + error.what());
  }
}

ModelFile read_model_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw Error("gradient model '" + path.string() +
                "' does not exist or is no file (give an nnmodel.pth or nnmini.pt, or a model that gelslam "
                "calibrate wrote)");
  refuse_lfs_pointer(path);
  std::ifstream stream(path, std::ios::binary);
  std::vector<unsigned char> bytes(kMaxModelBytes + 1);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream.is_open() || stream.bad()) throw Error("gradient model '" + path.string() + "' cannot be read");
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  if (bytes.size() > kMaxModelBytes)
    throw Error("gradient model '" + path.string() + "' is larger than 4 MiB, this is no gradient model");
  ModelFile file = parse_model_file(bytes, path.string());
  if (!file.model.optics) file.model.optics = find_optics(path);
  return file;
}

GradientModel read_model(const std::filesystem::path& path) { return read_model_file(path).model; }

void write_model_file(const std::filesystem::path& path, const ModelFile& file) {
  Json json = {{"format", kFormatName}, {"version", kFormatVersion}};
  if (file.record) json["calibration"] = to_json(*file.record);
  if (!file.model.sigma_rad.empty()) {
    Json& sigmas = json["slope_sigma_rad"] = Json::array();
    for (const float sigma : file.model.sigma_rad)
      sigmas.push_back(std::round(1e4 * static_cast<double>(sigma)) / 1e4);
  }
  if (file.model.optics) json["optics"] = *file.model.optics;
  if (file.model.bare_gel_bgr && !file.record) json["bare_gel_bgr"] = *file.model.bare_gel_bgr;
  if (file.model.slope_matrix != GradientModel{}.slope_matrix) json["slope_matrix"] = file.model.slope_matrix;
  const auto& wide = file.model.wide;
  if (wide && wide->gives_normals) json["gives_normals"] = true;
  const NetworkShape shape = wide ? wide->shape : GradientModel::kShape;
  const std::span<const float> all = wide ? std::span(wide->numbers) : file.model.numbers;
  json["layers"] = Json::array();
  for (std::size_t l = 0; l < NetworkShape::kLayers; ++l) {
    const auto layer = all.subspan(shape.start(l));
    json["layers"].push_back({{"weight", layer.first(shape.weights(l))},
                              {"bias", layer.subspan(shape.weights(l), shape.outputs(l))}});
  }
  write_file_atomically(path, json.dump() + "\n");
}

}  // namespace gelslam
