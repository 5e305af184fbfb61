#include "gl_pool.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace gelslam::viewer::detail {
namespace {

TEST(RangeList, NeverGivesAPlaceTwiceAndJoinsWhatComesBack) {
  constexpr std::size_t capacity = 1000;
  RangeList list(capacity);
  std::mt19937 random(3);
  std::map<std::size_t, std::size_t> taken;
  for (int i = 0; i < 5000; ++i) {
    if (taken.empty() || random() % 2 == 0) {
      const std::size_t count = 1 + random() % 60;
      const auto first = list.take(count);
      if (!first) continue;
      ASSERT_LE(*first + count, capacity);
      const auto after = taken.lower_bound(*first);
      if (after != taken.end()) {
        ASSERT_LE(*first + count, after->first);
      }
      if (after != taken.begin()) {
        ASSERT_LE(std::prev(after)->first + std::prev(after)->second, *first);
      }
      taken.emplace(*first, count);
    } else {
      const auto any = std::next(taken.begin(), static_cast<std::ptrdiff_t>(random() % taken.size()));
      list.release(any->first, any->second);
      taken.erase(any);
    }
  }
  for (const auto& [first, count] : taken) list.release(first, count);
  EXPECT_EQ(list.take(capacity), 0U) << "all in one piece again";
  EXPECT_EQ(list.take(1), std::nullopt);
}

}  // namespace
}  // namespace gelslam::viewer::detail
