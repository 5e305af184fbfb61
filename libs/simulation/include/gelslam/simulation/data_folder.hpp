#pragma once

#include <filesystem>

#include "gelslam/core/progress.hpp"
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
/// of its surface that were touched). The folder is made if it is not there; files in it are replaced, each
/// when whole. Throws Error.
void write_data_folder(const std::filesystem::path& folder, const Simulator& simulator,
                       const DataFolderOptions& options, ProgressSink& progress);

}  // namespace gelslam
