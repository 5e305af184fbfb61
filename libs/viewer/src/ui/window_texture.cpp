#include "ui/window_texture.hpp"

#include <epoxy/gl.h>

namespace gelslam::viewer::detail {

WindowTexture::~WindowTexture() {
  if (id_ != 0) glDeleteTextures(1, &id_);
}

void WindowTexture::set(const cv::Mat3b& bgr) {
  const cv::Mat3b rows = bgr.isContinuous() ? bgr : bgr.clone();
  if (id_ == 0) glGenTextures(1, &id_);
  glBindTexture(GL_TEXTURE_2D, id_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, rows.cols, rows.rows, 0, GL_BGR, GL_UNSIGNED_BYTE, rows.data);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_2D, 0);
  size_ = rows.size();
}

}  // namespace gelslam::viewer::detail
