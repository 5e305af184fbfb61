#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>

#include "gelslam/core/text.hpp"

namespace gelslam::detail {

/// Counts the pictures of a log that were used, and those that cannot be (damaged, black) while others can:
/// they are left out, and a sentence says so. Where nothing but such pictures comes, the log is the wrong
/// one.
class LeftOut {
 public:
  void use() { ++used_; }
  /// `damage`: which picture, and what is wrong with it. Throws it as an Error when the log has begun with
  /// ten of them.
  void leave_out(const std::string& damage);
  /// At the end of the log: throws the first damage, or else an Error that `what` ("the video") holds no
  /// readable frame, when none was used.
  void require_some(const std::string& what) const;
  /// Empty when none was left out.
  std::string warning() const;

 private:
  std::int64_t used_ = 0, left_out_ = 0;
  std::string first_;
};

/// Slopes are read from colors. Says so.
inline constexpr const char* kGrayPicture =
    "a gray picture; slopes are read from the sensor's colors, give the color video";

/// "first; second", without those that are empty.
inline std::string joined(std::initializer_list<std::string> warnings) {
  std::string text;
  for (const std::string& warning : warnings) append_sentence(text, warning);
  return text;
}

}  // namespace gelslam::detail
