#include "gelslam/surface/packed_surface.hpp"

#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam::test {
namespace {

SurfacePtr textured() {
  View view;
  view.contact_width_px = 120;
  view.contact_height_px = 90;
  view.contact_center_px = {40, -30};
  auto surface = std::make_shared<Surface>(*touch(textured_plane(3), motion(1, 2, 3, 0, 0, 0.5), view));
  surface->confidence = surface->contact.clone();
  surface->confidence.setTo(17, surface->contact);
  surface->slope_sigma_ratio = 0.25;
  return surface;
}

TEST(PackedSurface, IsOffByNoMoreThanHalfAStep) {
  const SurfacePtr before = textured();
  const SurfacePtr after = PackedSurface(*before).unpack();
  EXPECT_EQ(cv::norm(after->contact, before->contact, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(after->confidence, before->confidence, cv::NORM_INF), 0);
  EXPECT_EQ(after->contact_pixels, before->contact_pixels);
  EXPECT_EQ(after->pixel_pitch_mm, before->pixel_pitch_mm);
  EXPECT_EQ(after->slope_sigma_ratio, 0.25);
  EXPECT_EQ(after->zero_is_bare_gel, before->zero_is_bare_gel);
  const cv::Mat1b& where = before->contact;
  EXPECT_LE(cv::norm(after->height_mm, before->height_mm, cv::NORM_INF, where),
            0.5001 * PackedSurface::kHeightStepMm);
  EXPECT_LE(cv::norm(after->curvature, before->curvature, cv::NORM_INF, where),
            0.5001 * PackedSurface::kCurvatureStep);
  for (int v = 0; v < where.rows; ++v)
    for (int u = 0; u < where.cols; ++u) {
      if (!where(v, u)) continue;
      const cv::Vec3f a = after->normals(v, u), b = before->normals(v, u);
      ASSERT_LE(std::abs(a[0] - b[0]), 0.5001F * PackedSurface::kNormalStep);
      ASSERT_LE(std::abs(a[1] - b[1]), 0.5001F * PackedSurface::kNormalStep);
      ASSERT_NEAR(a.dot(a), 1, 1e-6);
    }
}

TEST(PackedSurface, KeepsMeansBeyondTheContact) {
  Surface before = *textured();
  const cv::Rect cell(8, 200, 4, 4);
  ASSERT_EQ(cv::countNonZero(before.contact(cell)), 0);
  for (int v = 0; v < before.height_mm.rows; ++v)  // a membrane rim
    for (int u = 0; u < 20; ++u) {
      before.height_mm(v, u) = -0.01F * static_cast<float>(u);
      before.normals(v, u) = cv::normalize(cv::Vec3f(0.01F * static_cast<float>(u), -0.1F, 1));
    }
  const SurfacePtr after = PackedSurface(before).unpack();
  const double height_mm = cv::mean(before.height_mm(cell))[0];
  const cv::Scalar normal = cv::mean(before.normals(cell));
  for (const cv::Point p : {cell.tl(), cell.br() - cv::Point(1, 1)}) {
    EXPECT_NEAR(after->height_mm(p), height_mm, 0.5001 * PackedSurface::kCoarseHeightStepMm);
    EXPECT_NEAR(after->normals(p)[0], normal[0], 0.5001 * PackedSurface::kCoarseNormalStep);
    EXPECT_NEAR(after->normals(p)[1], normal[1], 0.5001 * PackedSurface::kCoarseNormalStep);
    EXPECT_NEAR(cv::norm(after->normals(p)), 1, 1e-6);
  }
}

TEST(PackedSurface, PackingAgainChangesNothing) {
  const PackedSurface once(*textured());
  const PackedSurface twice(*once.unpack());
  EXPECT_TRUE(once.bytes() == twice.bytes());
  EXPECT_TRUE(PackedSurface::from_bytes(once.bytes()).bytes() == once.bytes());
  EXPECT_LT(once.bytes().size(), once.unpack()->height_mm.total() * 22 / 10) << "of 22 bytes per pixel";
}

TEST(PackedSurface, KeepsTheOpticsAndRefusesImpossibleOnes) {
  Surface surface = *textured();
  surface.optics = {0.045, {3, -2}, 1.02, 22, {0.0017, 0.0028}};
  const PackedSurface packed(surface);
  EXPECT_EQ(packed.unpack()->optics, surface.optics);
  EXPECT_TRUE(PackedSurface::from_bytes(packed.bytes()).bytes() == packed.bytes());
  surface.optics.camera_distance_mm = 2;
  const std::string forged = PackedSurface(surface).bytes();
  EXPECT_THROW(PackedSurface::from_bytes(forged), Error);
}

TEST(StoredSurface, IsTheSameWhetherPackedNowOrLater) {
  const SurfacePtr surface = textured();
  const StoredSurface as_it_is(surface), later = StoredSurface::packed_later(surface),
                                         now{PackedSurface(*surface)};
  EXPECT_EQ(as_it_is.get(), surface);
  EXPECT_EQ(cv::norm(later.get()->normals.reshape(1), now.get()->normals.reshape(1), cv::NORM_INF), 0);
  EXPECT_EQ(later.get(), later.get()) << "unpacked once while it is in use";
  EXPECT_TRUE(later.packed().bytes() == now.packed().bytes());
  EXPECT_EQ(later.facts().contact_pixels, surface->contact_pixels);
  EXPECT_TRUE(StoredSurface(later) == later);
  EXPECT_FALSE(later == now);
  EXPECT_FALSE(StoredSurface());
}

}  // namespace
}  // namespace gelslam::test
