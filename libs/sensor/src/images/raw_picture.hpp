#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam::detail {

/// Makes `bgr` the frame's picture; its times and counts stay.
inline void put_picture(const cv::Mat3b& bgr, RawFrame& frame) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(rows.ptr(), rows.ptr() + rows.total() * rows.elemSize());
  frame.width_px = rows.cols;
  frame.height_px = rows.rows;
}

}  // namespace gelslam::detail
