#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"

namespace gelslam {

struct DataFolderOptions {
  std::filesystem::path model;  ///< Gradient model that config.yaml names, by a relative path if possible.
  std::string name = {};        ///< Name of the scan in meta.json; empty: that of the folder.
  int threads = 0;              ///< 0: as many as there are cores. The files do not depend on it.
};

/// Writes a scan as a data folder of the public layout: gelsight.avi (25 Hz; the first frames are
/// background), config.yaml, true_start_T_currs.npy (N x 4 x 4 float64, meters, one per frame after the
/// background; NaN without contact), meta.json, gt_mesh.ply (object frame, meters), touched.npy (points of
/// its surface that were touched), and contact/ (SimulatedFrame::contact). The folder is created if it does
/// not exist; existing files are replaced one by one when the new file is complete. Throws Error.
void write_data_folder(const std::filesystem::path& folder, const Simulator& simulator,
                       const DataFolderOptions& options, ProgressSink& progress);

/// Returns the file with the true contact of a frame of the log. Background frames have none.
std::filesystem::path contact_file(const std::filesystem::path& folder, std::int64_t frame);

struct PressLogSpec {
  double diameter_mm = 6.31;  ///< of the ball, 3 .. 15
  int presses = 20;           ///< over the whole gel, 1 .. 500
  /// Frames of bare gel before the first touch, 0 .. 1000. With 0 the ball is on the gel at the start.
  int background_frames = 15;
  OpticsOptions optics;
  SensorGeometry geometry;
  double frame_rate_hz = 25.0;
  std::uint64_t seed = 1;  ///< Determines positions and depths.
};

/// A touch of the log with its ground truth.
struct SimulatedTouch {
  int first_frame = 0, last_frame = 0;  ///< First and last frame in which the ball is held still.
  cv::Point2d center_px;                ///< of the contact circle
  double radius_px = 0;                 ///< Radius of the contact circle.
};

/// Simulates the whole log and passes it to `take` image by image: bare gel, and for each touch approach,
/// hold, lift, and bare gel again. Deterministic. Throws Error for parameters out of range.
std::vector<SimulatedTouch> simulate_press_log(const PressLogSpec& spec,
                                               const std::function<void(const cv::Mat3b& bgr)>& take);

/// Writes the log as a data folder: gelsight.avi, config.yaml, touches.csv (ground truth). The folder is
/// created if it does not exist. Throws Error.
void write_press_log(const std::filesystem::path& folder, const PressLogSpec& spec, ProgressSink& progress);

}  // namespace gelslam
