#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <utility>

namespace gelslam {

/// A large object that is computed on demand. It is kept in memory as long as it is in use or among the
/// `capacity` most recently used objects of its type, and is freed when its LruCached is destroyed.
/// Thread-safe.
template <typename T, std::size_t capacity = 32>
class LruCached {
 public:
  LruCached() = default;
  ~LruCached() {
    if (const auto object = made_.lock()) recently_used().drop(object);
  }

  template <typename Make>
  std::shared_ptr<const T> get(const Make& make) {
    std::shared_ptr<const T> object;
    {
      const std::lock_guard lock(mutex_);
      object = made_.lock();
      if (!object) made_ = object = make();
    }
    recently_used().keep(object);
    return object;
  }

 private:
  class RecentlyUsed {
   public:
    void keep(const std::shared_ptr<const T>& object) {
      std::shared_ptr<const T> dropped;  // destroyed outside the lock
      const std::lock_guard lock(mutex_);
      const auto found = std::find(kept_.begin(), kept_.end(), object);
      if (found != kept_.end()) {
        std::rotate(found, found + 1, kept_.end());
        return;
      }
      kept_.push_back(object);
      if (kept_.size() <= capacity) return;
      dropped = std::move(kept_.front());
      kept_.pop_front();
    }

    void drop(const std::shared_ptr<const T>& object) {
      const std::lock_guard lock(mutex_);
      std::erase(kept_, object);
    }

   private:
    std::mutex mutex_;
    std::deque<std::shared_ptr<const T>> kept_;  // The most recently used one is at the end.
  };

  static RecentlyUsed& recently_used() {
    static RecentlyUsed objects;
    return objects;
  }

  std::mutex mutex_;
  std::weak_ptr<const T> made_;
};

}  // namespace gelslam
