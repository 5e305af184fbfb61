#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "run_program.hpp"

namespace gelslam::test {

/// What every mistake of a person must look like: exit code 2, nothing on stdout, one line on stderr that
/// holds `words`.
inline void expect_mistake(const ProgramResult& result, const std::string& words,
                           const std::string& program = "gelslam") {
  EXPECT_EQ(result.exit_code, 2) << words;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.error_lines(), 1) << result.err;
  EXPECT_THAT(result.err, testing::StartsWith(program + ": error: "));
  EXPECT_THAT(result.err, testing::HasSubstr(words));
}

}  // namespace gelslam::test
