#include "gelslam/core/trajectory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"

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

TEST(Trajectory, KeepsItsCovariancesInMetersBesideIt) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "covariances.npy";
  std::vector<StampedPose> written(3);
  for (std::size_t i = 0; i < written.size(); ++i) {
    Matrix6d root = Matrix6d::Identity();
    root(0, 3) = root(4, 2) = 0.3 + 0.1 * static_cast<double>(i);
    written[i].covariance = root * root.transpose();
  }
  write_covariances(file, written);
  const std::vector<double> numbers = read_npy(file).to_doubles();
  EXPECT_NEAR(numbers[0], 1e-6 * (*written[0].covariance)(3, 3), 1e-18) << "x in square meters";
  EXPECT_NEAR(numbers[3], 1e-3 * (*written[0].covariance)(3, 0), 1e-15) << "x with rx";
  EXPECT_NEAR(numbers[21], (*written[0].covariance)(0, 0), 1e-15) << "rx";
  std::vector<StampedPose> read(3), shorter(2);
  read_covariances(file, read);
  for (std::size_t i = 0; i < read.size(); ++i)
    EXPECT_TRUE(read[i].covariance->isApprox(*written[i].covariance, 1e-12));
  EXPECT_THROW(read_covariances(file, shorter), Error);
}

}  // namespace
}  // namespace gelslam
