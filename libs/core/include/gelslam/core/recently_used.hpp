#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>

namespace gelslam {

/// Keeps the 32 shared objects alive that were used last. Thread-safe.
template <typename SharedPointer>
class RecentlyUsed {
 public:
  void use(const SharedPointer& object) {
    SharedPointer dropped;  // destroyed outside the lock
    const std::lock_guard lock(mutex_);
    const auto found = std::find(kept_.begin(), kept_.end(), object);
    if (found != kept_.end()) {
      std::rotate(found, found + 1, kept_.end());
      return;
    }
    kept_.push_back(object);
    if (kept_.size() <= kCapacity) return;
    dropped = std::move(kept_.front());
    kept_.pop_front();
  }

 private:
  static constexpr std::size_t kCapacity = 32;

  std::mutex mutex_;
  std::deque<SharedPointer> kept_;  // the last used at the end
};

}  // namespace gelslam
