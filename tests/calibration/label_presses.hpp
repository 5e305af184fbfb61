#pragma once

#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "gelslam/calibration/label_session.hpp"

namespace gelslam::test {

/// Four presses (discs on a gray gel) in a folder, found where they are, but for the last one.
inline LabelSession four_presses(const std::filesystem::path& folder) {
  PressSet set;
  set.folder = folder;
  set.background = cv::Mat3b(120, 160, cv::Vec3b(90, 100, 110));
  std::vector<FoundCircle> found;
  for (int k = 0; k < 4; ++k) {
    const cv::Point center(60 + 10 * k, 50);
    cv::Mat3b bgr = set.background.clone();
    cv::circle(bgr, center, 20, cv::Scalar(60, 100, 150), cv::FILLED);
    const std::string name = "p" + std::to_string(k);
    std::filesystem::create_directories(folder / name);
    set.presses.push_back({name, 9.5, bgr, std::nullopt});
    found.push_back({{static_cast<double>(center.x), 50.0, 20.0}, 0.95, ""});
  }
  found.back().problem = "the contact is too small";
  return {set, found};
}

}  // namespace gelslam::test
