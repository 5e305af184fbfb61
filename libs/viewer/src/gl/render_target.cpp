#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/viewer/gl_context.hpp"
#include "gl/gl_objects.hpp"

namespace gelslam {

using namespace viewer::detail;

struct RenderTarget::Impl {
  int width, height;
  GlFramebuffer drawing, resolved;
  GlRenderbuffer color, depth, resolved_color;
};

RenderTarget::RenderTarget(int width_px, int height_px) {
  if (std::min(width_px, height_px) < 1 || std::max(width_px, height_px) > kMaxSidePx)
    throw Error("cannot draw a picture of " + std::to_string(width_px) + "x" + std::to_string(height_px) +
                " pixels: each side must be 1 to " + std::to_string(kMaxSidePx));
  impl_ = std::make_unique<Impl>(Impl{width_px, height_px, {}, {}, {}, {}, {}});
  GLint most = 0;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  const GLsizei used = std::min(kSamples, most);
  const auto attach = [&](const GlRenderbuffer& buffer, GLenum format, GLsizei of_samples, GLenum place) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffer.name());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, of_samples, format, width_px, height_px);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, buffer.name());
  };
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->resolved.name());
  attach(impl_->resolved_color, GL_RGBA8, 0, GL_COLOR_ATTACHMENT0);
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->drawing.name());
  attach(impl_->color, GL_RGBA8, used, GL_COLOR_ATTACHMENT0);
  attach(impl_->depth, GL_DEPTH_COMPONENT24, used, GL_DEPTH_ATTACHMENT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw Error("the graphics driver cannot draw a picture of " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + " pixels; try a smaller one");
}

RenderTarget::~RenderTarget() = default;

void RenderTarget::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, impl_->drawing.name());
  glViewport(0, 0, impl_->width, impl_->height);
}

cv::Mat3b RenderTarget::read() {
  const int w = impl_->width, h = impl_->height;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->drawing.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, impl_->resolved.name());
  glBlitFramebuffer(0, 0, w, h, 0, 0, w, h, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->resolved.name());
  cv::Mat rgba(h, w, CV_8UC4);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data);
  bind();
  cv::Mat bgr, upright;
  cv::cvtColor(rgba, bgr, cv::COLOR_RGBA2BGR);
  cv::flip(bgr, upright, 0);
  return upright;
}

}  // namespace gelslam
