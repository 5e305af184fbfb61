#include "gl/gl_pool.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

#include "scene_fixture.hpp"

namespace gelslam::viewer::detail {
namespace {

class GlPoolContents : public test::SceneDrawing {};

TEST_F(GlPoolContents, EveryRangeKeepsWhatWasWrittenThroughReuseAndGrowth) {
  GlPool pool(sizeof(std::uint32_t), 64);
  std::mt19937 random(5);
  std::map<std::size_t, std::vector<std::uint32_t>> written;
  for (int i = 0; i < 600; ++i) {
    if (written.size() < 8 || random() % 2 == 0) {
      std::vector<std::uint32_t> contents(1 + random() % 40);
      for (std::uint32_t& value : contents) value = static_cast<std::uint32_t>(random());
      const std::size_t first = pool.take(contents.size());
      pool.write(first, contents.size(), contents.data());
      ASSERT_TRUE(written.emplace(first, contents).second) << "given twice";
    } else {
      const auto any = std::next(written.begin(), static_cast<std::ptrdiff_t>(random() % written.size()));
      pool.release(any->first, any->second.size());
      written.erase(any);
    }
    if (i % 3 == 0) pool.end_frame();
  }
  EXPECT_GT(pool.buffer_version(), 0) << "it has grown";
  glBindBuffer(GL_COPY_READ_BUFFER, pool.buffer());
  for (const auto& [first, contents] : written) {
    std::vector<std::uint32_t> read(contents.size());
    glGetBufferSubData(GL_COPY_READ_BUFFER, static_cast<GLintptr>(first * sizeof(std::uint32_t)),
                       static_cast<GLsizeiptr>(read.size() * sizeof(std::uint32_t)), read.data());
    EXPECT_EQ(read, contents) << first;
  }
}

TEST_F(GlPoolContents, WhatIsStillBeingDrawnIsNotWrittenOver) {
  GlPool pool(sizeof(std::uint32_t), 8);
  const std::size_t first = pool.take(8);
  pool.release(first, 8);
  pool.end_frame();
  EXPECT_NE(pool.take(8), first) << "the frame before last may still be on its way";
  for (int i = 0; i < 5; ++i) pool.end_frame();
  EXPECT_EQ(pool.take(8), first);
}

}  // namespace
}  // namespace gelslam::viewer::detail
