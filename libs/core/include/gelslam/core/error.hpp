#pragma once

#include <stdexcept>
#include <string>

namespace gelslam {

/// An error in the user's input: a missing file, an unknown key, a truncated file. The message is one line
/// that says what is wrong, where, and what to do. main() prints it and exits with status 2.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message);  ///< The message is made one line, as it may quote a file.
};

}  // namespace gelslam
