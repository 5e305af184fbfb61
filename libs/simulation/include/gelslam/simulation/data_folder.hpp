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
  std::filesystem::path
      model;              ///< gradient model that config.yaml names (relative to the folder where possible)
  std::string name = {};  ///< that meta.json gives the scan; empty: the folder's
  int threads = 0;        ///< 0: as many as the machine has. The files do not depend on it.
};

/// Writes a scan as a data folder of the public layout: gelsight.avi (25 Hz; the first frames are
/// background), config.yaml, true_start_T_currs.npy (N x 4 x 4 float64, meters, one per frame after the
/// background; NaN where nothing touches), meta.json, gt_mesh.ply (object frame, meters), touched.npy (points
/// of its surface that were touched), contact/ (SimulatedFrame::contact). The folder is made if it is not
/// there; files in it are replaced, each when whole. Throws Error.
void write_data_folder(const std::filesystem::path& folder, const Simulator& simulator,
                       const DataFolderOptions& options, ProgressSink& progress);

/// Where a data folder has the true contact of a picture of its log, none of the background.
std::filesystem::path contact_file(const std::filesystem::path& folder, std::int64_t frame);

struct PressLogSpec {
  double diameter_mm = 6.31;  ///< of the ball, 3 .. 15
  int presses = 20;           ///< over the whole gel, 1 .. 500
  /// bare gel before the first touch, 0 .. 1000; with 0 the ball lies on the gel at the start
  int background_frames = 15;
  OpticsOptions optics;
  SensorGeometry geometry;
  double frame_rate_hz = 25.0;
  std::uint64_t seed = 1;  ///< of places and depths
};

/// One touch of the log, with the truth.
struct SimulatedTouch {
  int first_frame = 0, last_frame = 0;  ///< while the ball is held
  cv::Point2d center_px;                ///< of the contact circle
  double radius_px = 0;                 ///< the same
};

/// The whole log, picture by picture: bare gel, then for every touch approach, hold, lift and bare gel again.
/// Deterministic. Throws Error for a spec out of range.
std::vector<SimulatedTouch> simulate_press_log(const PressLogSpec& spec,
                                               const std::function<void(const cv::Mat3b& bgr)>& take);

/// Writes it as a data folder: gelsight.avi, config.yaml, touches.csv (the truth). The folder is made if it
/// is not there. Throws Error.
void write_press_log(const std::filesystem::path& folder, const PressLogSpec& spec, ProgressSink& progress);

}  // namespace gelslam
