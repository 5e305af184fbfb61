#include <algorithm>
#include <regex>

#include "bind.hpp"

namespace gelslam::python {
namespace {

/// What takes no value in the program is True here.
bool is_flag(const std::string& option) {
  return option == "overwrite" || option == "force" || option == "automatic";
}

/// The argument that an option of the program is: "truncation_mm", "force=True", "model=\"nnmodel.pth\"".
std::string argument_of(std::string option, const std::string& value) {
  if (option == "camera") option = "device";
  std::replace(option.begin(), option.end(), '-', '_');
  if (is_flag(option)) return option + "=True" + (value.empty() ? "" : " " + value);
  if (value.empty()) return option;
  const bool is_placeholder = value.find('.') == std::string::npos;  // IMAGE
  return option + "=" + (is_placeholder ? value : '"' + value + '"');
}

}  // namespace

std::string python_words(const std::string& message) {
  // A function that the module has, too; another command of the program, which keeps its option; an option.
  static const std::regex kProgramWords(
      "(^|[ (])(?:gelslam (fuse|merge|reconstruct)\\b|(gelslam [a-z]+ --[-a-z]+)|"
      "--([a-z][-a-z]*)(?: ([A-Z]+\\b|\\w+\\.\\w+))?)");
  std::string words;
  auto end = message.begin();
  for (std::sregex_iterator match(message.begin(), message.end(), kProgramWords), none; match != none;
       ++match) {
    words.append(end, (*match)[0].first).append((*match)[1]);
    if ((*match)[2].matched)
      words += "gelslam." + match->str(2) + "()";
    else if ((*match)[3].matched)
      words += match->str(3);
    else
      words += argument_of(match->str(4), match->str(5));
    end = (*match)[0].second;
  }
  return words.append(end, message.end());
}

void warn(const std::string& message) {
  if (PyErr_WarnEx(PyExc_UserWarning, python_words(message).c_str(), 1) != 0) throw py::error_already_set();
}

}  // namespace gelslam::python
