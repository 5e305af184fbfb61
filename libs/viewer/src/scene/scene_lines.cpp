#include "scene/scene_lines.hpp"

#include <cstddef>

namespace gelslam::viewer::detail {

static_assert(sizeof(SceneLine) == 32, "SceneLine is read by the GPU as it lies in memory");

SceneLines::SceneLines() {
  glBindVertexArray(vertex_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  const auto attribute = [](GLuint place, GLint size, GLenum type, GLboolean normalized, std::size_t offset) {
    glEnableVertexAttribArray(place);
    glVertexAttribPointer(place, size, type, normalized, sizeof(SceneLine),
                          reinterpret_cast<const void*>(offset));
    glVertexAttribDivisor(place, 1);
  };
  attribute(0, 3, GL_FLOAT, GL_FALSE, offsetof(SceneLine, from_mm));
  attribute(1, 3, GL_FLOAT, GL_FALSE, offsetof(SceneLine, to_mm));
  attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(SceneLine, color));
  attribute(3, 1, GL_FLOAT, GL_FALSE, offsetof(SceneLine, width_px));
  glBindVertexArray(0);
}

void SceneLines::set(const std::vector<SceneLine>& lines) {
  count_ = static_cast<GLsizei>(lines.size());
  glBindBuffer(GL_ARRAY_BUFFER, instances_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(lines.size() * sizeof(SceneLine)), lines.data(),
               GL_STREAM_DRAW);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
}

void SceneLines::draw() const {
  if (count_ == 0) return;
  glBindVertexArray(vertex_array_.name());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count_);
  glBindVertexArray(0);
}

}  // namespace gelslam::viewer::detail
