#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <cstdint>
#include <utility>

namespace gelslam::viewer::detail {

/// Owns one OpenGL name. The context it was made in must be current when it goes.
template <void (*Create)(GLuint&), void (*Destroy)(GLuint)>
class GlHandle {
 public:
  GlHandle() { Create(name_); }
  ~GlHandle() {
    if (name_ != 0) Destroy(name_);
  }
  GlHandle(GlHandle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlHandle& operator=(GlHandle&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

void create_buffer(GLuint& name);
void destroy_buffer(GLuint name);
void create_vertex_array(GLuint& name);
void destroy_vertex_array(GLuint name);
void create_texture(GLuint& name);
void destroy_texture(GLuint name);
void create_framebuffer(GLuint& name);
void destroy_framebuffer(GLuint name);
void create_renderbuffer(GLuint& name);
void destroy_renderbuffer(GLuint name);

using GlBuffer = GlHandle<create_buffer, destroy_buffer>;
using GlVertexArray = GlHandle<create_vertex_array, destroy_vertex_array>;
using GlTexture = GlHandle<create_texture, destroy_texture>;
using GlFramebuffer = GlHandle<create_framebuffer, destroy_framebuffer>;
using GlRenderbuffer = GlHandle<create_renderbuffer, destroy_renderbuffer>;

/// A linked pair of shaders. A mistake in their text is ours: std::logic_error with the compiler's words.
class GlProgram {
 public:
  GlProgram(const char* vertex_shader, const char* fragment_shader);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void use() const;
  /// Of the program in use.
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const Eigen::Vector2f& value) const;
  void set(const char* uniform, const Eigen::Vector3f& value) const;
  void set(const char* uniform, const Eigen::Matrix4f& value) const;

 private:
  GLuint name_ = 0;
};

/// A lookup table of 8-bit RGBA texels, linear between them, clamped at its ends.
void fill_texture(const GlTexture& texture, int width, int height, const std::uint8_t* rgba);

/// Whether the current context is one of Mesa's without a GPU.
bool is_software_renderer();

}  // namespace gelslam::viewer::detail
