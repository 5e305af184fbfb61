#pragma once

#include <stdexcept>
#include <string>

namespace gelslam {

/// A mistake in the input: a missing file, an unknown key, a truncated file. The message is one line that
/// says what is wrong, where, and what to do; main() prints it and exits with 2.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message);  ///< made one line: it may quote a file
};

}  // namespace gelslam
