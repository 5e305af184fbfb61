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

TEST(TumLine, HasTimeMetersAndQuaternionInTheFormatsOrder) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(1500, -2.5, 0.25);
  pose.linear() = so3_exp({0, 0, M_PI / 2});
  const std::string line = tum_line(0.04, pose);
  EXPECT_THAT(line, testing::StartsWith("0.04 1.5 -0.0025 0.00025 0 0 0.70710678118"));
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(numbers_in(line).size(), 8u);
}

TEST(TumLine, KeepsTheMicrosecondsOfUnixTimes) {
  for (std::int64_t us = 1764268461000000; us < 1764268461100000; us += 997) {
    const std::string line = tum_line(stamp_s(us, 0.04), Pose::Identity()), text = std::to_string(us);
    EXPECT_THAT(line, testing::StartsWith(text.substr(0, 10) + "." + text.substr(10) + " "));
  }
  EXPECT_EQ(stamp_s(0, 0.04), 0.04) << "not known";
}

TEST(TumLine, KeepsTwelveDigitsAndAPositiveW) {
  for (int i = 0; i < 60; ++i) {
    Vector6d xi;
    xi << 0.11 * i - 3, 0.05 * i, -0.07 * i + 1, 12.3456789012 * i, -0.98765432101 * i, 1e-3 / (i + 1);
    const Pose pose = se3_exp(xi);
    const std::vector<double> numbers = numbers_in(tum_line(1234.5678901 + i, pose));
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
