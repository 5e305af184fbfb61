#pragma once

#include <cstdint>
#include <map>
#include <utility>

namespace gelslam {

/// Keeps up to `most` items, evenly spaced, of a series of unknown length: every `step`-th item is kept, and
/// whenever there would be too many, every second one of these is dropped and `step` is doubled.
template <class T>
class EvenSample {
 public:
  explicit EvenSample(std::size_t most, std::int64_t step = 1) : most_(most), step_(step) {}

  void add(std::int64_t index, T item) {
    if (index % step_ != 0) return;
    items_.emplace(index, std::move(item));
    if (items_.size() < most_) return;
    step_ *= 2;
    std::erase_if(items_, [this](const auto& one) { return one.first % step_ != 0; });
  }
  std::map<std::int64_t, T>& items() { return items_; }

 private:
  std::size_t most_;
  std::int64_t step_;
  std::map<std::int64_t, T> items_;
};

}  // namespace gelslam
