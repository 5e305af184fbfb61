#pragma once

#include <epoxy/gl.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <utility>
#include <vector>

namespace gelslam::viewer::detail {

/// Owns an OpenGL object. The context in which it was created must be current when it is destroyed. The
/// functions are given as pointers that epoxy fills in.
template <auto* create, auto* destroy>
class GlHandle {
 public:
  GlHandle() { (*create)(1, &name_); }
  ~GlHandle() {
    if (name_ != 0) (*destroy)(1, &name_);
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

using GlBuffer = GlHandle<&glGenBuffers, &glDeleteBuffers>;
using GlVertexArray = GlHandle<&glGenVertexArrays, &glDeleteVertexArrays>;
using GlTexture = GlHandle<&glGenTextures, &glDeleteTextures>;
using GlFramebuffer = GlHandle<&glGenFramebuffers, &glDeleteFramebuffers>;
using GlRenderbuffer = GlHandle<&glGenRenderbuffers, &glDeleteRenderbuffers>;

/// Replaces the contents of a buffer, which stays bound to `target`.
template <typename T>
void upload(GLenum target, const GlBuffer& buffer, const std::vector<T>& elements) {
  glBindBuffer(target, buffer.name());
  glBufferData(target, static_cast<GLsizeiptr>(elements.size() * sizeof(T)), elements.data(),
               GL_DYNAMIC_DRAW);
}

/// Declares where an attribute of `size` numbers is in each Vertex of the bound buffer.
template <typename Vertex>
void set_attribute(GLuint place, GLint size, std::size_t offset, GLenum type = GL_FLOAT) {
  glEnableVertexAttribArray(place);
  glVertexAttribPointer(place, size, type, type == GL_INT_2_10_10_10_REV || type == GL_UNSIGNED_BYTE,
                        sizeof(Vertex), reinterpret_cast<const void*>(offset));  // NOLINT: as OpenGL asks
}

/// Triangles to be drawn with the current program.
class GlTriangles {
 public:
  template <typename Vertex>
  void set(const std::vector<Vertex>& vertices, const std::vector<Eigen::Vector3i>& triangles) {
    glBindVertexArray(array_.name());
    upload(GL_ARRAY_BUFFER, vertices_, vertices);
    Vertex::set_attributes();
    upload(GL_ELEMENT_ARRAY_BUFFER, indices_, triangles);
    glBindVertexArray(0);
    count_ = static_cast<GLsizei>(3 * triangles.size());
  }
  void draw() const {
    glBindVertexArray(array_.name());
    glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
    glBindVertexArray(0);
  }

 private:
  GlVertexArray array_;
  GlBuffer vertices_, indices_;
  GLsizei count_ = 0;
};

/// A linked pair of shaders. As an error in their text is a bug of this program, it throws std::logic_error
/// with the compiler's message.
class GlProgram {
 public:
  GlProgram(const char* vertex_shader, const char* fragment_shader);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void use() const;
  /// Sets a uniform of the current program.
  void set(const char* uniform, int value) const;
  void set(const char* uniform, float value) const;
  void set(const char* uniform, const Eigen::Vector2f& value) const;
  void set(const char* uniform, const Eigen::Vector3f& value) const;
  void set(const char* uniform, const Eigen::Matrix4f& value) const;

 private:
  GLuint name_ = 0;
};

/// Fills an image or lookup table of 8-bit RGBA texels, with linear interpolation and clamping.
void fill_texture(GLuint texture, int width, int height, const std::uint8_t* rgba);

/// Reads the current framebuffer as BGR, top row first.
cv::Mat3b read_pixels(int width, int height);

}  // namespace gelslam::viewer::detail
