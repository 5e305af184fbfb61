#include "gelslam/core/trajectory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace gelslam {
namespace {

std::vector<double> numbers_in(const std::string& line) {
  std::istringstream stream(line);
  std::vector<double> numbers;
  for (double number = 0; stream >> number;) numbers.push_back(number);
  return numbers;
}

TEST(TumLine, KeepsTheMicrosecondsOfUnixTimes) {
  for (std::int64_t us = 1764268461000000; us < 1764268461100000; us += 997) {
    const std::string line = tum_line(stamp_s(us, 0.04), Pose::Identity()), text = std::to_string(us);
    EXPECT_THAT(line, testing::StartsWith(text.substr(0, 10) + "." + text.substr(10) + " "));
  }
  EXPECT_EQ(stamp_s(0, 0.04), 0.04) << "not known";
}

TEST(TumLine, IsOneLineInTheFormatsOrderWithTwelveDigitsAndAPositiveW) {
  for (int i = 0; i < 60; ++i) {
    Vector6d xi;
    xi << 0.11 * i - 3, 0.05 * i, -0.07 * i + 1, 12.3456789012 * i, -0.98765432101 * i, 1e-3 / (i + 1);
    const Pose pose = se3_exp(xi);
    const std::string line = tum_line(1234.5678901 + i, pose);
    EXPECT_EQ(line.find('\n'), line.size() - 1);
    const std::vector<double> numbers = numbers_in(line);
    ASSERT_EQ(numbers.size(), 8u);
    EXPECT_NEAR(numbers[0], 1234.5678901 + i, 1e-8);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(numbers[static_cast<std::size_t>(1 + k)], pose.translation()(k) * 1e-3,
                  1e-11 * (1e-3 + std::abs(pose.translation()(k)) * 1e-3));
    EXPECT_GE(numbers[7], 0);
    const Eigen::Quaterniond q(numbers[7], numbers[4], numbers[5], numbers[6]);
    EXPECT_NEAR(q.norm(), 1, 1e-11);
    EXPECT_LT((q.toRotationMatrix() - pose.linear()).norm(), 1e-11);
  }
}

}  // namespace
}  // namespace gelslam
