#include "gelslam/core/bounded_queue.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

namespace gelslam {
namespace {

TEST(BoundedQueue, PushNewestThrowsAwayTheOldest) {
  BoundedQueue<int> queue(2);
  EXPECT_EQ(queue.push_newest(1), 0U);
  EXPECT_EQ(queue.push_newest(2), 0U);
  EXPECT_EQ(queue.push_newest(3), 1U);
  queue.push_beyond_limit(4);
  EXPECT_EQ(queue.size(), 3U);
  EXPECT_EQ(queue.push_newest(5), 2U);
  EXPECT_EQ(queue.try_pop(), 4);
  EXPECT_EQ(queue.try_pop(), 5);
  EXPECT_EQ(queue.try_pop(), std::nullopt);
}

TEST(BoundedQueue, WaitingEndsAtTheTimeWithAnItemAndAtTheEnd) {
  BoundedQueue<int> queue(1);
  const auto soon = [] { return std::chrono::steady_clock::now() + std::chrono::milliseconds(1); };
  EXPECT_TRUE(queue.wait_until(soon())) << "something may still come";
  queue.push(1);
  EXPECT_TRUE(queue.wait_until(std::chrono::steady_clock::now() + std::chrono::hours(1)));
  queue.close();
  EXPECT_TRUE(queue.wait_until(soon()));
  queue.pop();
  EXPECT_FALSE(queue.wait_until(soon()));
}

TEST(BoundedQueue, PushWaitsForRoomAndCloseWakesIt) {
  BoundedQueue<int> queue(1);
  queue.push(1);
  std::atomic<int> pushed{0};
  std::jthread producer([&] {
    pushed += queue.push(2) ? 1 : 0;
    pushed += queue.push(3) ? 1 : 0;
  });
  EXPECT_EQ(queue.pop(), 1);
  while (pushed == 0) std::this_thread::yield();
  EXPECT_EQ(queue.size(), 1U);  // 2 is in, 3 waits
  queue.close();
  producer.join();
  EXPECT_EQ(pushed, 1);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, ManyThreadsLoseNothingAndKeepEachOnesOrder) {
  constexpr int kPerThread = 2000, kThreads = 3;
  BoundedQueue<std::unique_ptr<int>> queue(4);
  std::vector<std::jthread> producers;
  for (int t = 0; t < kThreads; ++t)
    producers.emplace_back([&queue, t] {
      for (int i = 0; i < kPerThread; ++i) queue.push(std::make_unique<int>(t * kPerThread + i));
    });
  std::jthread closer([&] {
    for (std::jthread& producer : producers) producer.join();
    queue.close();
  });
  std::vector<int> last(kThreads, -1);
  int count = 0;
  while (const auto item = queue.pop()) {
    int& previous = last[static_cast<std::size_t>(**item / kPerThread)];
    EXPECT_LT(previous, **item);
    previous = **item;
    ++count;
  }
  EXPECT_EQ(count, kPerThread * kThreads);
}

}  // namespace
}  // namespace gelslam
