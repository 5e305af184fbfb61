#include "gelslam/core/swapped_bytes.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "gelslam/core/process.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMegabyte = std::size_t{1} << 20;

std::string block(char c) { return std::string(kMegabyte, c); }

TEST(SwappedBytes, GivesBackWhatItWasGiven) {
  const SwappedBytes none, empty(""), zero(std::string("a\0b", 3));
  EXPECT_EQ(none.read(), "");
  EXPECT_EQ(empty.read(), "");
  EXPECT_EQ(zero.read(), std::string("a\0b", 3));
}

TEST(SwappedBytes, TakeNoMemory) {
  const double before_mb = resident_memory_mb();
  std::vector<SwappedBytes> blocks;
  for (int i = 0; i < 64; ++i) blocks.emplace_back(block(static_cast<char>('a' + i % 26)));
  EXPECT_LT(resident_memory_mb() - before_mb, 16);
  for (int i = 0; i < 64; ++i)
    EXPECT_EQ(blocks[static_cast<std::size_t>(i)].read(), block(static_cast<char>('a' + i % 26)));
}

TEST(SwappedBytes, OutliveTheirNeighbors) {
  const SwappedBytes first(block('a'));
  auto second = std::make_unique<SwappedBytes>(block('b'));
  const SwappedBytes third(block('c')), copy = *second;
  second.reset();
  const SwappedBytes fourth(block('d'));
  EXPECT_EQ(first.read(), block('a'));
  EXPECT_EQ(copy.read(), block('b'));
  EXPECT_EQ(third.read(), block('c'));
  EXPECT_EQ(fourth.read(), block('d'));
}

// A process may hold some 65 000 mappings; then it gets no memory.
TEST(SwappedBytes, ManyAreNoMoreMappingsOrFiles) {
  const auto held = [] {
    std::ifstream maps("/proc/self/maps");
    const std::filesystem::directory_iterator files("/proc/self/fd");
    return std::count(std::istreambuf_iterator<char>(maps), {}, '\n') +
           std::distance(begin(files), end(files));
  };
  std::vector<SwappedBytes> blocks{SwappedBytes("a")};
  const auto before = held();
  for (int i = 0; i < 1000; ++i) blocks.emplace_back("b");
  EXPECT_LT(held() - before, 100);
}

TEST(SwappedBytes, SurviveAFork) {
  const SwappedBytes before(block('p'));
  const pid_t child = ::fork();
  if (child == 0) {
    const SwappedBytes own(block('c'));
    std::_Exit(before.read() == block('p') && own.read() == block('c') ? 0 : 1);
  }
  const SwappedBytes after(block('q'));
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(before.read(), block('p'));
  EXPECT_EQ(after.read(), block('q'));
}

}  // namespace
}  // namespace gelslam
