#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace gelslam {

/// Passes items from one thread to another, in order. The producer chooses what happens when the consumer is
/// behind: wait, lose the oldest item, or exceed the limit. All functions may be called from any thread.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Waits for room and adds the item. Returns false when the queue is closed; `item` is then lost.
  bool push(T item) {
    std::unique_lock lock(mutex_);
    not_full_.wait(lock, [this] { return closed_ || items_.size() < capacity_; });
    return append(std::move(item));
  }

  /// Adds the item without waiting: if the queue is full, the oldest items are dropped. Returns how many were
  /// dropped.
  std::size_t push_newest(T item) {
    const std::lock_guard lock(mutex_);
    std::size_t dropped = 0;
    for (; items_.size() >= capacity_; ++dropped) items_.pop_front();
    append(std::move(item));
    return dropped;
  }

  /// Adds the item without waiting or dropping, even if the limit is exceeded. Returns false when the queue
  /// is closed.
  bool push_beyond_limit(T item) {
    const std::lock_guard lock(mutex_);
    return append(std::move(item));
  }

  /// Waits for the next item; returns nothing when the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [this] { return closed_ || !items_.empty(); });
    return take();
  }

  /// Waits for an item, at most until `time`. Returns false when the queue is closed and empty.
  template <typename Time>
  bool wait_until(const Time& time) {
    std::unique_lock lock(mutex_);
    not_empty_.wait_until(lock, time, [this] { return closed_ || !items_.empty(); });
    return !closed_ || !items_.empty();
  }

  /// Returns the next item if there is one.
  std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    return take();
  }

  /// Closes the queue: no more items are accepted, but those inside can still be taken.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    not_empty_.notify_all();
    not_full_.notify_all();
  }

  std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return items_.size();
  }

 private:
  bool append(T&& item) {
    if (closed_) return false;
    items_.push_back(std::move(item));
    not_empty_.notify_one();
    return true;
  }

  std::optional<T> take() {
    std::optional<T> item;
    if (items_.empty()) return item;
    item.emplace(std::move(items_.front()));
    items_.pop_front();
    not_full_.notify_one();
    return item;
  }

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable not_empty_, not_full_;
  std::deque<T> items_;
  bool closed_ = false;
};

/// Closes a queue at the end of a scope, even if an exception leaves it.
template <typename T>
struct QueueCloser {
  BoundedQueue<T>& queue;
  ~QueueCloser() { queue.close(); }
};

}  // namespace gelslam
