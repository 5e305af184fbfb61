#include "gl/gl_objects.hpp"

#include <array>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

namespace gelslam::viewer::detail {
namespace {

GLuint compile(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  return shader;
}

}  // namespace

GlProgram::GlProgram(const char* vertex_shader, const char* fragment_shader) {
  const GLuint vertex = compile(GL_VERTEX_SHADER, vertex_shader);
  const GLuint fragment = compile(GL_FRAGMENT_SHADER, fragment_shader);
  name_ = glCreateProgram();
  glAttachShader(name_, vertex);
  glAttachShader(name_, fragment);
  glLinkProgram(name_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  GLint done = GL_FALSE;
  glGetProgramiv(name_, GL_LINK_STATUS, &done);
  if (done == GL_TRUE) return;
  std::array<char, 1024> words{};
  glGetProgramInfoLog(name_, static_cast<GLsizei>(words.size()), nullptr, words.data());
  glDeleteProgram(name_);
  throw std::logic_error(std::string("shaders do not compile or link: ") + words.data());
}

GlProgram::~GlProgram() { glDeleteProgram(name_); }

void GlProgram::use() const { glUseProgram(name_); }

void GlProgram::set(const char* uniform, int value) const {
  glUniform1i(glGetUniformLocation(name_, uniform), value);
}
void GlProgram::set(const char* uniform, float value) const {
  glUniform1f(glGetUniformLocation(name_, uniform), value);
}
void GlProgram::set(const char* uniform, const Eigen::Vector2f& value) const {
  glUniform2fv(glGetUniformLocation(name_, uniform), 1, value.data());
}
void GlProgram::set(const char* uniform, const Eigen::Vector3f& value) const {
  glUniform3fv(glGetUniformLocation(name_, uniform), 1, value.data());
}
void GlProgram::set(const char* uniform, const Eigen::Matrix4f& value) const {
  glUniformMatrix4fv(glGetUniformLocation(name_, uniform), 1, GL_FALSE, value.data());
}

void fill_texture(GLuint texture, int width, int height, const std::uint8_t* rgba) {
  glBindTexture(GL_TEXTURE_2D, texture);
  // Other code (such as a toolkit's font upload) may have changed these.
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_2D, 0);
}

cv::Mat3b read_pixels(int width, int height) {
  cv::Mat3b picture(height, width);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_BGR, GL_UNSIGNED_BYTE, picture.data);
  cv::flip(picture, picture, 0);
  return picture;
}

}  // namespace gelslam::viewer::detail
