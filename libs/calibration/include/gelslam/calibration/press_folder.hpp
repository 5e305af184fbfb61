#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/calibration/press_collector.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {

/// A calibration folder (see PressSet) that grows press by press. What is there is never overwritten, and
/// after every press it is whole: a session that breaks off loses nothing, and a later one goes on, with
/// another ball if it likes. Only one program at a time may use it: an existing folder is locked.
class PressFolder {
 public:
  /// Reads what is there; makes nothing yet. Throws Error when the folder holds something else, or presses
  /// that cannot be read, or when another program collects into it.
  PressFolder(const std::filesystem::path& folder, double diameter_mm);

  /// The background of an earlier session, or that written now; empty when there is none.
  const cv::Mat3b& background() const { return earlier_.background; }
  const PressSet& earlier() const { return earlier_; }  ///< the presses that were already there

  /// Creates the folder with background.png, if it does not exist. Throws Error, as for all that follows,
  /// when the disk does not take it; and when another program was quicker to make that folder.
  void write_background(const cv::Mat3b& background);
  /// Throws Error when this background, of now, is not that of the earlier presses: another sensor, gel or
  /// light.
  void require_same_gel(const cv::Mat3b& now) const;
  /// Writes `<diameter>mm/<n>/`, its circle as label, and the catalog's line; returns the press's name.
  std::string add(const CollectedPress& press);

 private:
  std::filesystem::path folder_;
  FolderLock lock_;
  double diameter_mm_;
  PressSet earlier_;
  std::size_t added_ = 0;
};

}  // namespace gelslam
