// A calibration folder that grows press by press, and what may be in it already.

#include "gelslam/calibration/press_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// A gel with some color: all of one shade but for a gradient.
cv::Mat3b bare_gel(int add = 0) {
  cv::Mat3b picture(60, 80);
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u)
      picture(v, u) =
          cv::Vec3b(static_cast<std::uint8_t>(100 + u / 2 + add), static_cast<std::uint8_t>(90 + v / 2 + add),
                    static_cast<std::uint8_t>(120 - u / 2 + add));
  return picture;
}

CollectedPress press_number(int number) {
  CollectedPress press;
  press.bgr = bare_gel();
  press.bgr(0, 0) = cv::Vec3b(static_cast<std::uint8_t>(number), 0, 0);
  press.circle = {10.0 + number, 20.0, 12.0};
  return press;
}

/// With a background and one press.
PressFolder begun(const fs::path& folder) {
  PressFolder presses(folder, 6.35);
  presses.write_background(bare_gel());
  presses.add(press_number(0));
  return presses;
}

TEST(PressFolder, IsAWholePressSetAfterEveryPress) {
  const TemporaryFolder place;
  const fs::path folder = place / "new/presses";
  PressFolder presses(folder, 6.35);
  EXPECT_FALSE(fs::exists(folder));  // nothing before there is something to keep
  presses.write_background(bare_gel());
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(presses.add(press_number(k)), "6.350mm/" + std::to_string(k));
    const PressSet set = read_press_set(folder);
    ASSERT_EQ(set.presses.size(), static_cast<std::size_t>(k + 1));
    EXPECT_EQ(set.presses.back().diameter_mm, 6.35);
    EXPECT_EQ(set.presses.back().bgr(0, 0)[0], k);
    ASSERT_TRUE(set.presses.back().label);
    EXPECT_EQ(set.presses.back().label->u_px, 10.0 + k);
  }
}

TEST(PressFolder, GoesOnWithAnotherBallAndOverwritesNothing) {
  const TemporaryFolder place;
  const fs::path folder = place / "presses";
  { PressFolder first = begun(folder); }
  const std::string picture = read_bytes(folder / "6.350mm/0/gelsight.png"),
                    background = read_bytes(folder / "background.png");
  fs::create_directory(folder / "6.350mm/1");  // as a power cut leaves it: no press, but somebody's
  {
    PressFolder again(folder, 6.35);
    EXPECT_EQ(again.earlier().presses.size(), 1U);
    again.require_same_gel(bare_gel(1));
    again.write_background(bare_gel(1));
    EXPECT_EQ(again.add(press_number(7)), "6.350mm/2");
  }
  PressFolder other(folder, 9.5);
  EXPECT_EQ(other.add(press_number(8)), "9.500mm/0");
  EXPECT_EQ(read_bytes(folder / "6.350mm/0/gelsight.png"), picture);
  EXPECT_EQ(read_bytes(folder / "background.png"), background);
  const PressSet set = read_press_set(folder);
  ASSERT_EQ(set.presses.size(), 3U);
}

TEST(PressFolder, RefusesWhatDoesNotBelongTogether) {
  const TemporaryFolder place;
  std::ofstream(place / "letter.txt") << "dear";
  EXPECT_THAT([&] { PressFolder(place.path(), 6.35); },
              ThrowsMessage<Error>(HasSubstr("something else than presses")));
  EXPECT_THAT([&] { PressFolder(place / "letter.txt", 6.35); }, ThrowsMessage<Error>(HasSubstr("is a file")));
  const fs::path folder = place / "presses";
  { PressFolder presses = begun(folder); }
  const PressFolder again(folder, 9.5);
  EXPECT_THAT([&] { again.require_same_gel(cv::Mat3b(120, 160)); },
              ThrowsMessage<Error>(HasSubstr("another sensor")));
  EXPECT_NO_THROW(again.require_same_gel(bare_gel(12))) << "light is followed";
  cv::Mat3b spotted = bare_gel();
  spotted(cv::Rect(20, 20, 16, 16)) = cv::Vec3b(20, 200, 20);
  EXPECT_THAT([&] { again.require_same_gel(spotted); }, ThrowsMessage<Error>(HasSubstr("another gel")));
}

}  // namespace
}  // namespace gelslam::test
