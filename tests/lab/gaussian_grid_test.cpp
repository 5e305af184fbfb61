#include "gaussian_grid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../support/analytic_surface.hpp"

namespace gelslam::baselines::detail {
namespace {

constexpr double kSigmaMm = 0.1;

/// The sums as their definition says, one exp() per point.
GaussianGrid::Sums summed(const ContactPoints& points, const Eigen::Vector3d& at) {
  GaussianGrid::Sums sums;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = std::exp(-0.5 * (points.position_mm[i] - at).squaredNorm() / (kSigmaMm * kSigmaMm));
    sums.weight += w;
    sums.position_mm += w * points.position_mm[i];
    sums.normal += w * points.normal[i];
  }
  sums.position_mm /= sums.weight;
  sums.normal /= sums.weight;
  return sums;
}

ContactPoints bumpy_points() {
  static const auto surface = test::touch(test::bumpy_ellipsoid(3), test::pressed(6.0, 0.8),
                                          test::View{.contact_width_px = 60, .contact_height_px = 50});
  return contact_points(*surface, 5000);
}

TEST(ContactPoints, LieOnTheSurfaceAndCoverItEvenly) {
  const auto surface = test::touch(test::bumpy_ellipsoid(3), test::pressed(6.0, 0.8));
  const ContactPoints all = contact_points(*surface, 1'000'000), some = contact_points(*surface, 700);
  EXPECT_EQ(static_cast<int>(all.size()), surface->contact_pixels);
  ASSERT_EQ(some.size(), 700U);
  Eigen::Vector3d mean_all = Eigen::Vector3d::Zero(), mean_some = mean_all;
  for (const auto& p : all.position_mm) mean_all += p / static_cast<double>(all.size());
  for (const auto& p : some.position_mm) mean_some += p / 700.0;
  EXPECT_LT((mean_all - mean_some).norm(), 0.1);  // of a contact 14 mm wide
  const double u = some.position_mm[350].x() / 0.0634 + 159.5, v = some.position_mm[350].y() / 0.0634 + 119.5;
  EXPECT_NEAR(u, std::round(u), 1e-6);
  EXPECT_NEAR(some.position_mm[350].z(),
              surface->height_mm(static_cast<int>(std::lround(v)), static_cast<int>(std::lround(u))), 1e-6);
  EXPECT_EQ(contact_points(*surface, 0).size(), 0U);
}

TEST(GaussianGrid, AgreesWithTheSumItStandsFor) {
  const ContactPoints points = bumpy_points();
  const GaussianGrid grid(points, kSigmaMm);
  std::mt19937_64 random(1);
  int looked_at = 0;
  double log_ratio = 0;
  for (std::size_t i = 0; i < points.size(); i += 97) {
    Eigen::Vector3d at = points.position_mm[i];
    for (int axis = 0; axis < 3; ++axis) at[axis] += 0.5 * kSigmaMm * test::normal_deviate(random);
    const GaussianGrid::Sums exact = summed(points, at), found = grid.at(at);
    ASSERT_GT(found.weight, 0);
    // A lattice of one sigma ripples: single weights by up to a fifth, means by a tenth of sigma at a border.
    EXPECT_NEAR(found.weight, exact.weight, 0.25 * exact.weight);
    log_ratio += std::log(found.weight / exact.weight);
    EXPECT_LT((found.position_mm - exact.position_mm).norm(), 0.1 * kSigmaMm);
    EXPECT_LT((found.normal - exact.normal).norm(), 0.02);
    ++looked_at;
  }
  EXPECT_GT(looked_at, 30);
  EXPECT_NEAR(log_ratio / looked_at, 0, 0.03) << "the lattice's own width is not made up for";
}

TEST(GaussianGrid, ThereIsNothingFarAway) {
  const GaussianGrid grid(bumpy_points(), kSigmaMm);
  EXPECT_EQ(grid.at({0, 0, 5}).weight, 0);
  EXPECT_EQ(grid.at({50, 0, 0}).weight, 0);
  EXPECT_EQ(grid.at({-1e300, 1e300, 0}).weight, 0);
  EXPECT_EQ(grid.at({std::nan(""), 0, 0}).weight, 0);
}

TEST(GaussianGrid, TakesASinglePoint) {
  ContactPoints one;
  one.position_mm = {{1, 2, 3}};
  one.normal = {{0, 0, 1}};
  const GaussianGrid grid(one, kSigmaMm);
  const GaussianGrid::Sums sums = grid.at({1, 2, 3.05});
  EXPECT_LT((sums.position_mm - one.position_mm[0]).norm(), 1e-5);
  EXPECT_LT((sums.normal - one.normal[0]).norm(), 1e-5);
}

}  // namespace
}  // namespace gelslam::baselines::detail
