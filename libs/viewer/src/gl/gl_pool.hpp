#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>

#include "gl/gl_objects.hpp"

namespace gelslam::viewer::detail {

/// Which parts of a row of elements are free (first fit, neighbors joined).
class RangeList {
 public:
  explicit RangeList(std::size_t capacity) { release(0, capacity); }
  std::optional<std::size_t> take(std::size_t count);
  void release(std::size_t first, std::size_t count);

 private:
  std::map<std::size_t, std::size_t> free_;  // first -> count
};

/// One GPU buffer shared by many blocks, each with a range of elements of its own. A range is written once:
/// new contents get a new range, and the old one is used again only after some frames, so that writing never
/// waits for drawing.
class GlPool {
 public:
  GlPool(std::size_t element_bytes, std::size_t capacity);

  /// First element of a new range. When the buffer grows its name changes: buffer_version() tells.
  std::size_t take(std::size_t count);
  void release(std::size_t first, std::size_t count);
  void write(std::size_t first, std::size_t count, const void* elements);
  void end_frame();

  GLuint buffer() const { return buffer_.name(); }
  int buffer_version() const { return version_; }

 private:
  struct Released {
    std::int64_t frame;
    std::size_t first, count;
  };
  void grow(std::size_t needed);

  std::size_t element_bytes_, capacity_;
  GlBuffer buffer_;
  RangeList free_;
  std::deque<Released> released_;
  std::int64_t frame_ = 0;
  int version_ = 0;
};

}  // namespace gelslam::viewer::detail
