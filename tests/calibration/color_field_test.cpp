#include "training/color_field.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace gelslam::test {
namespace {

using namespace calibration::detail;

constexpr float kDark = 0.04F;  // as the field has it

/// A gel under one lamp whose light falls off to the right, to a ninth. A slope takes 0.8 per radian of that
/// light, or always as much as in the middle.
SlopeSample lit_sample(bool of_the_light, float x, float y, float angle_x, float angle_y) {
  SlopeSample sample;
  sample.place = {x, y};
  sample.angle_rad = {angle_x, angle_y};
  const auto light = [](float at) { return 0.6F / (1.0F + 8.0F * at * at); };
  for (std::size_t c = 0; c < 3; ++c) {
    sample.flat_color[c] = light(x) - kDark;
    sample.color[c] =
        sample.flat_color[c] + light(of_the_light ? x : 0.5F) * 0.8F * (c == 0 ? angle_x : angle_y);
  }
  return sample;
}

// Presses lie in the left two thirds only. What they show is carried on to the right third in the right kind.
TEST(ColorField, TellsFromThePressesWhetherSlopesChangeLevelsOrShares) {
  for (const bool of_the_light : {true, false}) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> number(0.0F, 1.0F);
    std::vector<SlopeSample> samples;
    for (int press = 0; press < 40; ++press) {
      const float x = 0.62F * number(random), y = number(random);
      for (int k = 0; k < 400; ++k) {
        samples.push_back(lit_sample(of_the_light, x + 0.05F * number(random), y,
                                     0.8F * number(random) - 0.4F, 0.8F * number(random) - 0.4F));
        samples.back().zone = press;
      }
    }
    const ColorField field(samples);
    EXPECT_EQ(field.is_relative(), of_the_light);
    for (const float x : {0.3F, 0.8F, 0.95F}) {
      const SlopeSample there = lit_sample(of_the_light, x, 0.5F, 0.25F, -0.15F);
      const auto change = field.change(there.place, there.angle_rad);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(change[c] * field.unit(there.flat_color[c]), there.color[c] - there.flat_color[c], 0.002F)
            << x << " " << c;
    }
  }
}

// Gel that is pressed in flat is brighter than bare gel (on real sensors by up to 19 levels, differently from
// place to place): that must not be taken for a slope.
TEST(ColorField, KnowsThatPressedGelIsBrighterWithoutAnySlope) {
  const auto brighter = [](float x) { return 0.03F + 0.04F * x; };
  std::mt19937 random(9);
  std::uniform_real_distribution<float> number(0.0F, 1.0F);
  std::vector<SlopeSample> samples;
  for (int press = 0; press < 40; ++press) {
    const float x = number(random), y = number(random);
    for (int k = 0; k < 400; ++k) {
      const float at = 0.9F * x + 0.05F * number(random);
      samples.push_back(lit_sample(false, at, y, 0.8F * number(random) - 0.4F, 0.8F * number(random) - 0.4F));
      for (float& color : samples.back().color) color += brighter(at);
      samples.back().zone = press;
    }
  }
  const ColorField field(samples);
  for (const float x : {0.2F, 0.5F, 0.8F})
    for (const float angle : {0.0F, 0.25F}) {
      const SlopeSample there = lit_sample(false, x, 0.5F, angle, -angle);
      const auto change = field.change(there.place, there.angle_rad);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(change[c] * field.unit(there.flat_color[c]),
                    there.color[c] - there.flat_color[c] + brighter(x), 0.002F)
            << x << " " << angle << " " << c;
    }
}

}  // namespace
}  // namespace gelslam::test
