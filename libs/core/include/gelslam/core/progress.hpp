#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace gelslam {

/// Where long work says how far it is. Library code reports to a sink and never prints; the program chooses
/// the sink. One task at a time, from one thread.
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  /// A task of `total` steps starts (unknown: nothing); `task` is a noun for people: "tracking".
  virtual void begin(std::string_view task, std::optional<std::int64_t> total) = 0;
  /// `done` steps of the task are done in all. Cheap enough to call for every frame.
  virtual void update(std::int64_t done) = 0;
  virtual void end() = 0;
};

/// Says nothing: the default of libraries and tests.
class NoProgress final : public ProgressSink {
 public:
  void begin(std::string_view, std::optional<std::int64_t>) override {}
  void update(std::int64_t) override {}
  void end() override {}
};

}  // namespace gelslam
