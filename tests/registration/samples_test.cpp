// Which pixels of a contact NormalFlow looks at.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "../support/analytic_surface.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_reference.hpp"

namespace gelslam {
namespace {

using namespace test;

struct Sample {
  int u, v;
  double bend;
};

std::vector<Sample> samples_of(const SurfacePtr& surface, int max_samples) {
  NormalFlowOptions options;
  options.max_samples = max_samples;
  const NormalFlowReference reference(surface, options);
  const NormalFlowReference::Impl& impl = reference.impl();
  std::vector<Sample> samples;
  const double pitch = surface->pixel_pitch_mm;
  for (std::size_t k = 0; k < impl.curvature.size(); ++k)
    samples.push_back({static_cast<int>(std::lround(impl.samples.x[k] / pitch + 159.5)),
                       static_cast<int>(std::lround(impl.samples.y[k] / pitch + 119.5)),
                       std::fabs(impl.curvature[k])});
  return samples;
}

TEST(Samples, AreAsManyAsAskedForEachOnceAndInTheContact) {
  View sliver;  // hardly wider than a pixel: most cells of a grid over it are cut
  sliver.contact_width_px = 140;
  sliver.contact_height_px = 2.5;
  const Pose pose = motion(0, 0, 0, 0, 0, 0.4);
  for (const SurfacePtr surface : {touch(textured_plane(1), pose), touch(textured_plane(1), pose, sliver)})
    for (const int wanted : {50, 777, 3000, 1000000}) {
      const std::vector<Sample> samples = samples_of(surface, wanted);
      EXPECT_EQ(samples.size(), static_cast<std::size_t>(std::min(wanted, surface->contact_pixels)));
      std::set<std::pair<int, int>> places;
      for (const Sample& sample : samples) {
        places.insert({sample.u, sample.v});
        EXPECT_TRUE(surface->contact(sample.v, sample.u));
      }
      EXPECT_EQ(places.size(), samples.size());
    }
}

TEST(Samples, BendMoreThanTheContactAndLieAllOverIt) {
  const auto surface = touch(textured_plane(3), motion(0, 0, 0, 0, 0, 0.4));
  double mean = 0;
  int pixels = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u)
      if (surface->contact(v, u)) {
        mean += std::fabs(surface->curvature(v, u));
        ++pixels;
      }
  mean /= pixels;
  const std::vector<Sample> samples = samples_of(surface, 2000);
  double sampled = 0;
  int quarters[4] = {};
  for (const Sample& sample : samples) {
    sampled += sample.bend / 2000;
    ++quarters[2 * (sample.v < 120) + (sample.u < 160)];
  }
  EXPECT_GT(sampled, 1.3 * mean) << "they fix x, y and twist";
  for (const int count : quarters) EXPECT_GT(count, 250) << "half of them are even";
}

}  // namespace
}  // namespace gelslam
