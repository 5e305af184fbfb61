#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace gelslam::viewer::detail {

/// Owns one OpenGL name. The context it was made in must be current when it goes.
template <auto& Generate, auto& Delete>
class GlHandle {
 public:
  GlHandle() { Generate(1, &name_); }
  ~GlHandle() {
    if (name_ != 0) Delete(1, &name_);
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

using GlBuffer = GlHandle<glGenBuffers, glDeleteBuffers>;
using GlVertexArray = GlHandle<glGenVertexArrays, glDeleteVertexArrays>;
using GlTexture = GlHandle<glGenTextures, glDeleteTextures>;
using GlFramebuffer = GlHandle<glGenFramebuffers, glDeleteFramebuffers>;
using GlRenderbuffer = GlHandle<glGenRenderbuffers, glDeleteRenderbuffers>;

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

/// Where vertices in the bound buffer, of `vertex_bytes` each, have an attribute.
void set_attribute(GLuint place, GLint numbers, GLenum type, bool normalized, std::size_t vertex_bytes,
                   std::size_t offset);

/// Replaces a buffer's contents; it stays bound.
template <typename T>
void fill_buffer(GLenum kind, const GlBuffer& buffer, const std::vector<T>& elements, GLenum usage) {
  glBindBuffer(kind, buffer.name());
  glBufferData(kind, static_cast<GLsizeiptr>(elements.size() * sizeof(T)), elements.data(), usage);
}

/// A picture or lookup table of 8-bit RGBA texels, linear between them, clamped at its ends.
void fill_texture(GLuint texture, int width, int height, const std::uint8_t* rgba);

/// Whether the current context is one of Mesa's without a GPU.
bool is_software_renderer();

}  // namespace gelslam::viewer::detail
