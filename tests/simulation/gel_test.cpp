// The gel: against the closed form of a pressed ball, and against the conditions that make a solution the
// solution.

#include "gelslam/simulation/gel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

const SensorGeometry kSensor;

/// Underside of a ball at (x0, y0) whose lowest point is at -depth.
cv::Mat1f ball(double radius, double depth, double x0 = 0, double y0 = 0) {
  cv::Mat1f underside(kSensor.height_px, kSensor.width_px, std::numeric_limits<float>::infinity());
  for (int v = 0; v < underside.rows; ++v)
    for (int u = 0; u < underside.cols; ++u) {
      const double r = std::hypot(kSensor.x_mm(u) - x0, kSensor.y_mm(v) - y0);
      if (r < radius)
        underside(v, u) = static_cast<float>(radius - depth - std::sqrt(radius * radius - r * r));
    }
  return underside;
}

/// Contact radius of a rigid ball on a membrane under tension on springs: outside, the membrane is
/// -w K0(r/l)/K0(a/l); at the contact's edge a its height and slope are the ball's (no adhesion, no kink).
double contact_radius(double radius, double depth, double length) {
  double low = 1e-3, high = std::sqrt(2 * radius * depth - depth * depth);
  for (int k = 0; k < 100; ++k) {
    const double a = 0.5 * (low + high);
    const double w = depth - radius + std::sqrt(radius * radius - a * a);
    const double membrane_rim =
        w / length * std::cyl_bessel_k(1.0, a / length) / std::cyl_bessel_k(0.0, a / length);
    (membrane_rim > a / std::sqrt(radius * radius - a * a) ? low : high) = a;
  }
  return low;
}

class BallInAGel : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(BallInAGel, HasTheContactRadiusAndRimOfTheClosedForm) {
  constexpr double length = kGelRelaxationMm;
  const auto [radius, depth] = GetParam();
  const GelShape gel = press_gel(ball(radius, depth), kSensor);
  const double expected = contact_radius(radius, depth, length);
  const double area = cv::countNonZero(gel.contact) * kSensor.pixel_pitch_mm * kSensor.pixel_pitch_mm;
  EXPECT_NEAR(std::sqrt(area / std::acos(-1.0)), expected, kSensor.pixel_pitch_mm);  // a pixel
  EXPECT_LT(expected, std::sqrt(2 * radius * depth));  // less than where the ball cuts z = 0
  const double edge = depth - radius + std::sqrt(radius * radius - expected * expected);
  for (int u = 160; u < kSensor.width_px; ++u) {
    const double r = std::hypot(kSensor.x_mm(u), kSensor.y_mm(120));
    if (r < expected + 0.1) continue;
    const double membrane_rim =
        -edge * std::cyl_bessel_k(0.0, r / length) / std::cyl_bessel_k(0.0, expected / length);
    EXPECT_NEAR(gel.height_mm(120, u), membrane_rim, 0.01 * depth) << "at radius " << r;
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, BallInAGel,
                         testing::Values(std::tuple(3.155, 0.5), std::tuple(4.75, 0.3), std::tuple(4.75, 0.9),
                                         std::tuple(10.0, 0.4)));

/// A bumpy, pitted landscape that partly touches.
cv::Mat1f landscape() {
  cv::Mat1f underside(kSensor.height_px, kSensor.width_px);
  for (int v = 0; v < underside.rows; ++v)
    for (int u = 0; u < underside.cols; ++u) {
      const float x = kSensor.x_mm(u), y = kSensor.y_mm(v);
      underside(v, u) = 0.03F * x * x + 0.05F * y * y - 0.6F + 0.15F * std::sin(5 * x + 1) * std::cos(4 * y);
    }
  return underside;
}

TEST(Gel, SatisfiesTheConditionsOfTheObstacleProblem) {
  const cv::Mat1f underside = landscape();
  const GelShape gel = press_gel(underside, kSensor);
  const double scale = std::pow(kSensor.pixel_pitch_mm / kGelRelaxationMm, 2);
  int touching = 0, free = 0;
  for (int v = 1; v + 1 < underside.rows; ++v)
    for (int u = 1; u + 1 < underside.cols; ++u) {
      const cv::Mat1f& h = gel.height_mm;
      ASSERT_LE(h(v, u), underside(v, u) + 1e-6F);
      ASSERT_LE(h(v, u), 1e-6F);
      // Net upward pull of membrane and springs; the object's push balances it, and it can only push down.
      const double pull = h(v, u - 1) + h(v, u + 1) + h(v - 1, u) + h(v + 1, u) - (4 + scale) * h(v, u);
      if (gel.contact(v, u) != 0) {
        ++touching;
        ASSERT_GT(pull, -2e-4);
      } else {
        ++free;
        ASSERT_NEAR(pull, 0, 2e-4);  // mm; a millimeter of missing force would be 0.03
      }
    }
  EXPECT_GT(touching, 3000);
  EXPECT_GT(free, 3000);
}

TEST(Gel, BordersAreFree) {
  // A ridge across the whole picture, whichever way it runs: the gel is the same all along it, up to the
  // border.
  cv::Mat1f along(kSensor.height_px, kSensor.width_px), across(kSensor.height_px, kSensor.width_px);
  for (int v = 0; v < kSensor.height_px; ++v)
    for (int u = 0; u < kSensor.width_px; ++u) {
      along(v, u) = 0.2F * kSensor.y_mm(v) * kSensor.y_mm(v) - 0.5F;
      across(v, u) = 0.2F * kSensor.x_mm(u) * kSensor.x_mm(u) - 0.5F;
    }
  const cv::Mat1f a = press_gel(along, kSensor).height_mm, b = press_gel(across, kSensor).height_mm;
  for (int v = 0; v < kSensor.height_px; ++v)
    for (int u = 0; u < kSensor.width_px; ++u) {
      ASSERT_NEAR(a(v, u), a(v, 160), 1e-4F);
      ASSERT_NEAR(b(v, u), b(120, u), 1e-4F);
    }
  EXPECT_LT(a(85, 0), -0.01F);  // there is a membrane rim at the border to speak of
}

TEST(Gel, IsUntouchedFarAway) {
  const GelShape gel = press_gel(ball(3.155, 0.5, -6, -3), kSensor);
  for (int v = 0; v < kSensor.height_px; ++v)
    for (int u = 0; u < kSensor.width_px; ++u) {
      const double dx = std::abs(kSensor.x_mm(u) + 6), dy = std::abs(kSensor.y_mm(v) + 3);
      if (std::max(dx, dy) > 5.6) {
        ASSERT_EQ(gel.height_mm(v, u), 0.0F);
      }
      if (std::hypot(dx, dy) > 4.0) {
        ASSERT_GT(gel.height_mm(v, u), -0.003F);
      }
    }
}

TEST(Gel, FollowsAFlatPlateEverywhere) {
  const GelShape gel = press_gel(cv::Mat1f(kSensor.height_px, kSensor.width_px, -0.4F), kSensor);
  EXPECT_EQ(cv::countNonZero(gel.contact), kSensor.width_px * kSensor.height_px);
  EXPECT_EQ(cv::countNonZero(gel.height_mm != -0.4F), 0);
  EXPECT_EQ(cv::norm(gel.slope, cv::NORM_INF), 0);
}

TEST(Gel, SlopesSumUpToItsHeight) {
  const GelShape gel = press_gel(ball(4.75, 0.6, 1.0, -0.7), kSensor);
  // Trapezoids from the border, where the gel is at rest: another rule than the differences that made the
  // slopes.
  for (const int v : {60, 108, 130}) {
    double height = 0;
    for (int u = 1; u < kSensor.width_px; ++u) {
      height += 0.5 * kSensor.pixel_pitch_mm * (gel.slope(v, u - 1)[0] + gel.slope(v, u)[0]);
      ASSERT_NEAR(height, gel.height_mm(v, u), 0.004);
    }
  }
}

TEST(Gel, MistakesAreErrors) {
  EXPECT_THROW(press_gel(cv::Mat1f(100, 100, 0.0F), kSensor), Error);
  EXPECT_THROW(press_gel(cv::Mat1f(), kSensor), Error);
}

TEST(Gel, AContactThatTheBorderCutsIsTheSameAsOneInTheMiddle) {
  ShapeSpec spec;
  spec.name = "sphere";
  const ShapePtr shape = make_shape(spec);
  Pose middle = Pose::Identity(), edge = Pose::Identity();
  middle.translation() << 0, 0, 7.4;
  constexpr int shift_px = 150;  // the ball's lowest point comes to lie 10 pixels from the right border
  edge.translation() << shift_px * kSensor.pixel_pitch_mm, 0, 7.4;
  const GelShape whole = press_object(*shape, middle, kSensor), cut = press_object(*shape, edge, kSensor);
  for (int v = 0; v < kSensor.height_px; ++v)
    for (int u = shift_px; u < kSensor.width_px; ++u)
      ASSERT_NEAR(cut.height_mm(v, u), whole.height_mm(v, u - shift_px), 0.01F);
}

TEST(Underside, OfABallIsTheBall) {
  ShapeSpec spec;
  spec.name = "sphere";  // radius 8 mm
  Pose sensor_T_object = Pose::Identity();
  sensor_T_object.linear() = so3_exp({0.4, -1.1, 2.0});
  sensor_T_object.translation() << 2, -1, 7.3;
  const cv::Mat1f cast = object_underside(*make_shape(spec), sensor_T_object, kSensor);
  const cv::Mat1f expected = ball(8, 0.7, 2, -1);
  for (int v = 0; v < cast.rows; ++v)
    for (int u = 0; u < cast.cols; ++u) {
      if (expected(v, u) < 0.0F) {
        ASSERT_NEAR(cast(v, u), expected(v, u), 3e-4F);
      }
      if (expected(v, u) > 0.05F) {
        ASSERT_TRUE(std::isinf(cast(v, u)));
      }
    }
}

TEST(Underside, OfAMeshIsThatOfTheObjectItWasMadeFrom) {
  ShapeSpec spec;
  spec.name = "peanut";
  const ShapePtr shape = make_shape(spec);
  Pose sensor_T_object = Pose::Identity();
  sensor_T_object.linear() = so3_exp({0.7, 0.1, 0.3});
  sensor_T_object.translation() << 0, 0, 6.2;
  const cv::Mat1f a = object_underside(*shape, sensor_T_object, kSensor);
  const cv::Mat1f b = object_underside(*make_mesh_shape(shape->mesh(0.1F)), sensor_T_object, kSensor);
  int compared = 0;
  for (int v = 0; v < a.rows; ++v)
    for (int u = 0; u < a.cols; ++u) {
      if (!(a(v, u) < -0.05F)) continue;
      ++compared;
      ASSERT_NEAR(a(v, u), b(v, u), 0.01F);
    }
  EXPECT_GT(compared, 2000);
}

}  // namespace
}  // namespace gelslam
