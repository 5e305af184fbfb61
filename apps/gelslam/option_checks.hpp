#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace gelslam {

/// Checks of options' values, for CLI::Option::check(): "" or, for people, why not.

/// Of a file to write that is `what` ("pictures are written as PNG"): another ending promises something else.
std::string refuse_unless_png(const std::string& path);
std::string refuse_unless_html(const std::string& path);

/// A number, all of it and nothing else: no comma, no unit.
CLI::Validator number_between(double least, double most);

}  // namespace gelslam
