#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gelslam/surface/gradient_model.hpp"

namespace gelslam {

/// How a model was trained. Model files that `gelslam calibrate train` writes have such a record.
struct CalibrationRecord {
  int width_px = 0, height_px = 0;   ///< the size of the pictures
  double pixel_pitch_mm = 0.0;       ///< mm per pixel
  int presses = 0;                   ///< the number of presses used for training
  std::vector<double> diameters_mm;  ///< the diameters of the balls
  std::uint64_t seed = 0;            ///< the seed of the random numbers in training
  cv::Mat3f background_cells;        ///< mean colors of the bare gel, see background_cells()
};
/// The number of columns and rows of CalibrationRecord::background_cells.
inline const cv::Size kBackgroundGrid{20, 15};

/// Returns the mean color (B, G, R in gray levels) of each of 20x15 cells of a picture of the bare gel. The
/// picture has to have at least that many pixels.
cv::Mat3f background_cells(const cv::Mat3b& background);

/// Returns the mean B, G, R of a picture or of background_cells(), in gray levels.
std::array<float, 3> mean_color(const cv::Mat& bgr);

/// The largest model file that is read. A typical nnmodel.pth has 13 KiB, nnmini.pt has 74 KiB, and a model
/// of this program has 40 KiB.
inline constexpr std::size_t kMaxModelBytes = 4 * 1024 * 1024;

/// The content of a model file.
struct ModelFile {
  GradientModel model;
  std::optional<CalibrationRecord> record;  ///< not present in files of PyTorch
};

/// Reads a gradient model from a PyTorch file (a zip archive, see parse_pth_model) or from a file of this
/// program (JSON, see docs/file-formats.md); the two are distinguished by their content. If the model does
/// not state the optics of its sensor, they are read from an optics.yaml in the same folder. Throws Error if
/// the file cannot be read, is damaged, was written by a newer version, or holds another network.
ModelFile read_model_file(const std::filesystem::path& path);
GradientModel read_model(const std::filesystem::path& path);

/// Reads a gradient model from bytes in memory, without an optics.yaml. `name` is the name of the file in
/// errors. Throws Error like read_model_file().
ModelFile parse_model_file(std::span<const unsigned char> bytes, const std::string& name);

/// Reads a PyTorch state_dict, which is a pickle in a zip archive: `nnmodel.pth` of the public systems, or
/// `nnmini.pt` of GelSight. No code is executed: only the opcodes and globals that a state_dict of tensors
/// needs are known, and all others are refused. Batch normalizations are folded into the layers. Throws Error
/// if the file is damaged or holds another network.
GradientModel parse_pth_model(std::span<const unsigned char> file, const std::string& name);

/// Writes a model in the JSON format of this program, as a whole or not at all. The same content gives the
/// same bytes. Throws Error if the file cannot be written.
void write_model_file(const std::filesystem::path& path, const ModelFile& file);

}  // namespace gelslam
