#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::viewer::detail {

/// A picture that ImGui can draw. Needs the context it was made with to be current.
class WindowTexture {
 public:
  WindowTexture() = default;
  ~WindowTexture();
  WindowTexture(const WindowTexture&) = delete;
  WindowTexture& operator=(const WindowTexture&) = delete;

  void set(const cv::Mat3b& bgr);
  bool empty() const { return size_.area() == 0; }
  unsigned id() const { return id_; }
  /// Height over width.
  float aspect() const {
    return empty() ? 0 : static_cast<float>(size_.height) / static_cast<float>(size_.width);
  }

 private:
  unsigned id_ = 0;
  cv::Size size_;
};

}  // namespace gelslam::viewer::detail
