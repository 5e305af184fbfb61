#include "gelslam/core/even_sample.hpp"

#include <gtest/gtest.h>

#include <iterator>
#include <memory>

namespace gelslam {
namespace {

// What is kept of a log that does not know its length: of 15 000 surfaces of 2 MB no more than of any other.
TEST(EvenSample, HoldsNoMoreThanItMayAndIsEven) {
  EvenSample<std::shared_ptr<int>> sample(300);
  const auto counted = std::make_shared<int>();
  for (int i = 0; i < 15'000; ++i) {
    sample.add(i, counted);
    ASSERT_LE(counted.use_count(), 301) << i;
  }
  auto& items = sample.items();
  EXPECT_GE(items.size(), 150U);
  const std::int64_t step = std::next(items.begin())->first;
  std::int64_t expected = 0;
  for (const auto& [index, item] : items) EXPECT_EQ(index, step * expected++);
  EXPECT_GE(items.rbegin()->first + step, 15'000);
}

TEST(EvenSample, BeginsWithTheStepOfAKnownLength) {
  EvenSample<int> sample(300, 3);
  for (int i = 0; i < 450; ++i) sample.add(i, i);
  EXPECT_EQ(sample.items().size(), 150U);
}

}  // namespace
}  // namespace gelslam
