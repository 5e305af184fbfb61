#include "touch_studio.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "simulated_frames.hpp"

namespace gelslam::lab {
namespace {

TouchStudio& studio() {
  static TouchStudio one(simulated_frames().model);
  return one;
}

/// Where the reference's contact, laid on the target by a pose, meets the target's contact.
struct Meeting {
  double share = 0, height_gap_mm = 0;  ///< the gap: median of absolute values
};

Meeting meet(const TouchPair& pair, const Pose& target_T_reference) {
  const Surface &reference = *pair.reference, &target = *pair.target;
  const double pitch = reference.pixel_pitch_mm;
  const auto cols = reference.contact.cols, rows = reference.contact.rows;
  std::vector<double> gaps;
  for (int v = 0; v < rows; ++v)
    for (int u = 0; u < cols; ++u) {
      if (reference.contact(v, u) == 0) continue;
      const Eigen::Vector3d p =
          target_T_reference * Eigen::Vector3d((u + 0.5 - 0.5 * cols) * pitch, (v + 0.5 - 0.5 * rows) * pitch,
                                               reference.height_mm(v, u));
      const int tu = static_cast<int>(std::floor(p.x() / pitch + 0.5 * cols)),
                tv = static_cast<int>(std::floor(p.y() / pitch + 0.5 * rows));
      if (tu < 0 || tv < 0 || tu >= cols || tv >= rows || target.contact(tv, tu) == 0) continue;
      gaps.push_back(std::abs(target.height_mm(tv, tu) - p.z()));
    }
  return {static_cast<double>(gaps.size()) / reference.contact_pixels, median(gaps)};
}

class OfObject : public testing::TestWithParam<const char*> {};

TEST_P(OfObject, TruthLaysTheSurfacesOnEachOther) {
  for (const double overlap : {0.8, 0.4}) {
    TouchSpec spec;
    spec.object = GetParam();
    spec.place = 2;
    spec.overlap = overlap;
    const TouchPair pair = studio().make(spec);
    const Pose truth = pair.target_T_reference();
    const Meeting right = meet(pair, truth);
    // Heights are read to some hundredths of a millimeter; a pose that is 1 mm off lays texture on other
    // texture.
    EXPECT_LT(right.height_gap_mm, 0.06) << overlap;
    for (const double side : {-1.0, 1.0})
      EXPECT_GT(meet(pair, Eigen::Translation3d(side, side, 0) * truth).height_gap_mm, right.height_gap_mm);
    // What the program reads as contact is a little less than what touches, in both. A coin touches with
    // its flat middle and its rim, so that half of what is asked is left where little overlaps.
    EXPECT_NEAR(pair.overlap, overlap, 0.1);
    EXPECT_NEAR(right.share, overlap, 0.25);
  }
}

INSTANTIATE_TEST_SUITE_P(TouchStudio, OfObject, testing::Values("pebble", "peanut", "coin", "golf"));

TEST(TouchStudio, FullOverlapIsTheSameTouchSeenTwice) {
  TouchSpec spec;
  spec.overlap = 1;
  const TouchPair pair = studio().make(spec);
  EXPECT_TRUE(pair.target_T_reference().isApprox(Pose::Identity(), 1e-12));
  EXPECT_EQ(pair.overlap, 1.0);
  EXPECT_GT(cv::norm(pair.reference->height_mm, pair.target->height_mm, cv::NORM_INF), 0);  // other noise
}

TEST(TouchStudio, PressesAsDeepAsAsked) {
  for (const double depth : {0.4, 1.0, 1.5}) {
    TouchSpec spec;
    spec.depth = depth;
    const TouchPair pair = studio().make(spec);
    double deepest = 0;
    cv::minMaxLoc(pair.reference->height_mm, &deepest);
    EXPECT_NEAR(-deepest, depth * ordinary_indentation_mm(ShapeKind::body), 0.08);
  }
}

TEST(TouchStudio, MakesTheSameOfTheSame) {
  const TouchSpec spec;
  const TouchPair once = studio().make(spec), again = TouchStudio(simulated_frames().model).make(spec);
  EXPECT_EQ(cv::norm(once.target->normals, again.target->normals, cv::NORM_INF), 0);
}

/// Root mean square of what two surfaces differ by where both touch.
double difference_mm(const Surface& a, const Surface& b) {
  const cv::Mat1b both(a.contact & b.contact);
  return cv::norm(a.height_mm, b.height_mm, cv::NORM_L2, both) /
         std::sqrt(std::max(1, cv::countNonZero(both)));
}

TEST(TouchStudio, NoiseGrainsAndLightDisturbWhatIsRead) {
  const TouchSpec clean;
  const SurfacePtr target = studio().make(clean).target;
  TouchSpec noisy = clean, dirty = clean, lit = clean;
  noisy.noise_gain = 8;
  dirty.grains = 500;
  lit.light_change = 0.2;
  lit.light_jumps = true;
  TouchSpec quiet = clean;
  quiet.noise_gain = 0.5;
  const double by_quiet = difference_mm(*studio().make(quiet).target, *target);
  EXPECT_GT(difference_mm(*studio().make(noisy).target, *target), 2 * by_quiet);
  EXPECT_GT(difference_mm(*studio().make(dirty).target, *target), 2 * by_quiet);
  // Light that changes is followed. What is left is of the size of the sensor's own noise.
  const double by_light = difference_mm(*studio().make(lit).target, *target);
  EXPECT_GT(by_light, 0);
  EXPECT_LT(by_light, 2 * by_quiet);
}

TEST(TouchStudio, TextureIsScaledAndThePlaceKept) {
  TouchSpec smooth, rough;
  smooth.texture = 0;
  const TouchPair polished = studio().make(smooth), textured = studio().make(rough);
  const auto curvature = [](const Surface& s) {
    return cv::norm(s.curvature, cv::NORM_L2) / std::sqrt(static_cast<double>(s.contact_pixels));
  };
  EXPECT_LT(curvature(*polished.reference), 0.5 * curvature(*textured.reference));
  EXPECT_TRUE(polished.reference_T_object.linear().isApprox(textured.reference_T_object.linear()));
}

TEST(TouchStudio, RefusesWhatItCannotDo) {
  TouchSpec spec;
  spec.place = TouchSpec::kPlaces;
  EXPECT_THROW(studio().make(spec), Error);
  spec.place = 0;
  spec.object = "pebbel";
  EXPECT_THROW(studio().make(spec), Error);
  spec.object = "sphere";
  spec.grains = -1;
  EXPECT_THROW(studio().make(spec), Error);
}

TEST(TouchStudio, MovesTheObjectAsAsked) {
  TouchSpec spec;
  spec.overlap = 1;
  spec.moved.translation() = Eigen::Vector3d(0.6, -0.8, 0);
  const TouchPair pair = studio().make(spec);
  const Pose step = pair.target_T_reference();
  // Settled anew: only its height may differ.
  EXPECT_NEAR(step.translation().x(), 0.6, 1e-9);
  EXPECT_NEAR(step.translation().y(), -0.8, 1e-9);
  EXPECT_NEAR(rotation_angle_rad(step), 0, 1e-9);
  EXPECT_LT(pair.overlap, 0.99);
  EXPECT_LT(meet(pair, step).height_gap_mm, 0.06);
}

}  // namespace
}  // namespace gelslam::lab
