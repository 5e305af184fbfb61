#include "gl/gl_pool.hpp"

#include <cstring>
#include <iterator>
#include <utility>

namespace gelslam::viewer::detail {
namespace {

constexpr std::int64_t kFramesInFlight = 3;

}  // namespace

std::optional<std::size_t> RangeList::take(std::size_t count) {
  for (auto range = free_.begin(); range != free_.end(); ++range) {
    const auto [first, size] = *range;
    if (size < count) continue;
    free_.erase(range);
    if (size > count) free_.emplace(first + count, size - count);
    return first;
  }
  return std::nullopt;
}

void RangeList::release(std::size_t first, std::size_t count) {
  if (count == 0) return;
  const auto next = free_.lower_bound(first);
  if (next != free_.end() && first + count == next->first) {
    count += next->second;
    free_.erase(next);
  }
  const auto after = free_.lower_bound(first);
  if (after != free_.begin()) {
    const auto before = std::prev(after);
    if (before->first + before->second == first) {
      before->second += count;
      return;
    }
  }
  free_.emplace(first, count);
}

GlPool::GlPool(std::size_t element_bytes, std::size_t capacity)
    : element_bytes_(element_bytes), capacity_(capacity), free_(capacity) {
  glBindBuffer(GL_COPY_WRITE_BUFFER, buffer_.name());
  glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(capacity_ * element_bytes_), nullptr,
               GL_DYNAMIC_DRAW);
}

std::size_t GlPool::take(std::size_t count) {
  auto first = free_.take(count);
  if (!first) {
    grow(count);
    first = free_.take(count);
  }
  return *first;
}

void GlPool::release(std::size_t first, std::size_t count) {
  if (count > 0) released_.push_back({frame_, first, count});
}

void GlPool::end_frame() {
  ++frame_;
  while (!released_.empty() && released_.front().frame + kFramesInFlight <= frame_) {
    free_.release(released_.front().first, released_.front().count);
    released_.pop_front();
  }
}

void GlPool::grow(std::size_t needed) {
  const std::size_t capacity = 2 * capacity_ + needed;
  GlBuffer larger;
  // COPY targets: binding an index buffer elsewhere would change the vertex array that is bound.
  glBindBuffer(GL_COPY_READ_BUFFER, buffer_.name());
  glBindBuffer(GL_COPY_WRITE_BUFFER, larger.name());
  glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(capacity * element_bytes_), nullptr,
               GL_DYNAMIC_DRAW);
  glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0,
                      static_cast<GLsizeiptr>(capacity_ * element_bytes_));
  free_.release(capacity_, capacity - capacity_);
  capacity_ = capacity;
  buffer_ = std::move(larger);
  ++version_;
}

void GlPool::write(std::size_t first, std::size_t count, const void* elements) {
  if (count == 0) return;
  const auto offset = static_cast<GLintptr>(first * element_bytes_);
  const auto bytes = static_cast<GLsizeiptr>(count * element_bytes_);
  glBindBuffer(GL_COPY_WRITE_BUFFER, buffer_.name());
  void* mapped = glMapBufferRange(GL_COPY_WRITE_BUFFER, offset, bytes,
                                  GL_MAP_WRITE_BIT | GL_MAP_UNSYNCHRONIZED_BIT | GL_MAP_INVALIDATE_RANGE_BIT);
  if (mapped != nullptr) {
    std::memcpy(mapped, elements, static_cast<std::size_t>(bytes));
    if (glUnmapBuffer(GL_COPY_WRITE_BUFFER) == GL_TRUE) return;
  }
  glBufferSubData(GL_COPY_WRITE_BUFFER, offset, bytes, elements);  // no mapping, or it was lost meanwhile
}

}  // namespace gelslam::viewer::detail
