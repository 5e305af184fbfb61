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

/// How a model was made; kept in model files of our own.
struct CalibrationRecord {
  int width_px = 0, height_px = 0;
  double pixel_pitch_mm = 0.0;
  int presses = 0;                   ///< used for training
  std::vector<double> diameters_mm;  ///< of the balls
  std::uint64_t seed = 0;
  cv::Mat3f background_cells;  ///< mean BGR of the bare gel in kBackgroundGrid cells, gray levels
};
inline const cv::Size kBackgroundGrid{20, 15};

/// The bare gel as a record keeps it: means of 20x15 cells. `background` must be at least that large.
cv::Mat3f background_cells(const cv::Mat3b& background);

/// Returns the mean B, G, R of a picture or of such cells.
std::array<float, 3> mean_color(const cv::Mat& bgr);

/// A model file is not larger; an nnmodel.pth has 13 KiB, an nnmini.pt 74, our own 40.
inline constexpr std::size_t kMaxModelBytes = 4 * 1024 * 1024;

struct ModelFile {
  GradientModel model;
  std::optional<CalibrationRecord> record;  ///< nothing in an nnmodel.pth
};

/// Reads a model of either kind, told apart by content: PyTorch's (zip, see parse_pth_model) or our own
/// (JSON, see docs/file-formats.md). Throws Error when it is neither, damaged, of a newer version, or no
/// network of these kinds. A model that does not say its sensor's optics gets those of an optics.yaml beside
/// it.
ModelFile read_model_file(const std::filesystem::path& path);
GradientModel read_model(const std::filesystem::path& path);

/// The same from bytes in memory; `name` stands for the file in errors.
ModelFile parse_model_file(std::span<const unsigned char> bytes, const std::string& name);

/// Reads a PyTorch state_dict (`nnmodel.pth`, or the maker's `nnmini.pt`: zip + pickle) without ever running
/// code: only the opcodes and globals a state_dict of tensors needs are known, all else is refused. Batch
/// normalizations become part of the layers. Throws Error.
GradientModel parse_pth_model(std::span<const unsigned char> file, const std::string& name);

/// Writes our own format, whole or not at all; the same content gives the same bytes. Throws Error when the
/// disk does not take it.
void write_model_file(const std::filesystem::path& path, const ModelFile& file);

}  // namespace gelslam
