#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

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
  /// that cannot be read, or when another program collects into it. `labels`: circles are written as
  /// label.npz.
  PressFolder(const std::filesystem::path& folder, double diameter_mm, bool labels);

  /// The background of an earlier session; empty when there is none.
  const cv::Mat3b& background() const { return background_; }
  /// The contacts of this ball's presses that were already there.
  std::vector<ContactCircle> earlier_circles(double pixel_pitch_mm) const;

  /// Creates the folder with background.png, if it does not exist. Throws Error, as for all that follows,
  /// when the disk does not take it; and when another program was quicker to make that folder.
  void write_background(const cv::Mat3b& background);
  /// Throws Error when this background, of now, is not that of the earlier presses: another sensor, gel or
  /// light.
  void require_same_gel(const cv::Mat3b& now) const;
  /// Writes <diameter>mm/<n>/ and the catalog's line; returns the press's name.
  std::string add(const CollectedPress& press);
  /// Removes the last press that was added by this object, file by file; false when there is none.
  bool take_back();

 private:
  std::filesystem::path folder_;
  FolderLock lock_;
  double diameter_mm_;
  bool labels_;
  cv::Mat3b background_;
  PressSet earlier_;
  std::vector<std::string> added_;
};

}  // namespace gelslam
