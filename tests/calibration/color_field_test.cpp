#include "training/color_field.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace gelslam::test {
namespace {

using namespace calibration::detail;

constexpr float kDark = 0.04F;  // as the field has it

/// The light of one lamp, which falls off to the right, to a ninth.
float light_at(float x) { return 0.6F / (1.0F + 8.0F * x * x); }

/// A slope takes 0.8 per radian of that light. Pressed gel is brighter than bare gel by a share of it.
SlopeSample lit_sample(float x, float y, float angle_x, float angle_y, float brighter = 0.0F) {
  SlopeSample sample;
  sample.place = {x, y};
  sample.angle_rad = {angle_x, angle_y};
  for (std::size_t c = 0; c < 3; ++c) {
    sample.flat_color[c] = light_at(x) - kDark;
    sample.color[c] = sample.flat_color[c] + light_at(x) * (brighter + 0.8F * (c == 0 ? angle_x : angle_y));
  }
  return sample;
}

/// Forty presses in the left part of the gel, up to `width`.
template <class Brighter>
ColorField field_of_presses(float width, const Brighter& brighter) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> number(0.0F, 1.0F);
  std::vector<SlopeSample> samples;
  for (int press = 0; press < 40; ++press) {
    const float x = (width - 0.05F) * number(random), y = number(random);
    for (int k = 0; k < 400; ++k) {
      const float at = x + 0.05F * number(random);
      samples.push_back(
          lit_sample(at, y, 0.8F * number(random) - 0.4F, 0.8F * number(random) - 0.4F, brighter(at)));
    }
  }
  return ColorField(samples);
}

void expect_change_to(const ColorField& field, const SlopeSample& there) {
  const auto change = field.change(there.place, there.angle_rad);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(change[c] * ColorField::unit(there.flat_color[c]), there.color[c] - there.flat_color[c],
                0.002F)
        << there.place[0] << " " << there.angle_rad[0] << " " << c;
}

// Presses lie in the left two thirds only. What they show is carried on to the right third, where the lamp is
// weaker.
TEST(ColorField, CarriesSlopesToADarkCornerAsSharesOfItsLight) {
  const ColorField field = field_of_presses(0.67F, [](float) { return 0.0F; });
  for (const float x : {0.3F, 0.8F, 0.95F}) expect_change_to(field, lit_sample(x, 0.5F, 0.25F, -0.15F));
}

// Gel that is pressed in flat is brighter than bare gel (on real sensors by up to 19 levels, differently from
// place to place): that must not be taken for a slope.
TEST(ColorField, KnowsThatPressedGelIsBrighterWithoutAnySlope) {
  const auto brighter = [](float x) { return 0.05F + 0.07F * x; };
  const ColorField field = field_of_presses(0.95F, brighter);
  for (const float x : {0.2F, 0.5F, 0.8F})
    for (const float angle : {0.0F, 0.25F})
      expect_change_to(field, lit_sample(x, 0.5F, angle, -angle, brighter(x)));
}

}  // namespace
}  // namespace gelslam::test
