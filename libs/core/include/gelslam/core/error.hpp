#pragma once

#include <stdexcept>

namespace gelslam {

/// A mistake in the input: a missing file, an unknown key, a truncated file. The message is one line that
/// says what is wrong, where, and what to do; main() prints it and exits with 2.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace gelslam
