#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/calibration/press_collector.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {

/// A calibration folder (see PressSet) to which presses are added. Existing presses and the background are
/// never overwritten, and the folder is complete after every press: if a session is interrupted, nothing is
/// lost, and a later one can continue it, also with another ball. The folder is locked, because only one
/// program at a time may add to it.
class PressFolder {
 public:
  /// Reads an existing folder; creates nothing yet. Throws Error when the folder contains files but
  /// neither a catalog nor a background, or unreadable presses, or when another program is adding to it.
  PressFolder(const std::filesystem::path& folder, double diameter_mm);

  /// Background of an earlier session, or the one written now; empty if there is none.
  const cv::Mat3b& background() const { return earlier_.background; }
  const PressSet& earlier() const { return earlier_; }  ///< Presses that already existed.

  /// Writes background.png, and creates the folder for it if necessary; does nothing if there is a
  /// background. Like add(), throws Error when a file cannot be written; also when another program has
  /// created the folder in the meantime.
  void write_background(const cv::Mat3b& background);
  /// Throws Error when the current background `now` differs from that of the earlier presses, which means
  /// another sensor, gel or light.
  void require_same_gel(const cv::Mat3b& now) const;
  /// Writes `<diameter>mm/<n>/` with the circle as its label, and a line in the catalog. Returns the name of
  /// the press.
  std::string add(const CollectedPress& press);

 private:
  std::filesystem::path folder_;
  FolderLock lock_;
  double diameter_mm_;
  PressSet earlier_;
  std::size_t added_ = 0;
};

}  // namespace gelslam
