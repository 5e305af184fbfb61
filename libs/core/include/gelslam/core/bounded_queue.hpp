#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace gelslam {

/// Hands things from one thread to the next, in order. Whoever puts them in chooses what happens when the
/// next thread is behind: wait, lose the oldest, or go over the limit. All functions may be called from any
/// thread.
template <typename T>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t capacity) : capacity_(capacity) {}

  /// Waits for room. False when the queue is closed: `item` is gone.
  bool push(T item) {
    std::unique_lock lock(mutex_);
    not_full_.wait(lock, [this] { return closed_ || items_.size() < capacity_; });
    return append(std::move(item));
  }

  /// Never waits: makes room by throwing away the oldest. Returns how many were thrown away.
  std::size_t push_newest(T item) {
    const std::lock_guard lock(mutex_);
    std::size_t dropped = 0;
    for (; items_.size() >= capacity_; ++dropped) items_.pop_front();
    append(std::move(item));
    return dropped;
  }

  /// Never waits and never loses: for the rare message that must not wait, whatever the limit.
  bool push_beyond_limit(T item) {
    const std::lock_guard lock(mutex_);
    return append(std::move(item));
  }

  /// Waits for the next one; nothing when the queue is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    not_empty_.wait(lock, [this] { return closed_ || !items_.empty(); });
    return take();
  }

  /// The next one if it is there.
  std::optional<T> try_pop() {
    const std::lock_guard lock(mutex_);
    return take();
  }

  /// Nothing more goes in; what is in can still be taken out.
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

}  // namespace gelslam
