#include "gelslam/viewer/mesh_picture.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "gelslam/viewer/gl_context.hpp"
#include "test_meshes.hpp"

namespace gelslam {
namespace {

using test::height_field;
using test::plane;

constexpr int kPanelPx = 160;

/// The color in the middle of one of the three panels.
cv::Vec3d panel_color(const cv::Mat3b& picture, int panel) {
  const int x = panel * kPanelPx + kPanelPx / 2;
  const cv::Scalar mean = cv::mean(picture(cv::Rect(x - 8, picture.rows / 2 - 8, 16, 16)));
  return {mean[0], mean[1], mean[2]};
}

bool is_colored(const cv::Vec3d& bgr) {
  return std::max({bgr[0], bgr[1], bgr[2]}) - std::min({bgr[0], bgr[1], bgr[2]}) >
         10.0;  // clay: 16, paper: 5
}

class MeshPicture : public testing::Test {
 protected:
  void SetUp() override {
    try {
      GlContext::offscreen();
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
};

TEST_F(MeshPicture, ColorsFollowTheDistance) {
  const auto slope = [](double x, double) { return 0.01 * (x + 5); };  // 0 to 0.1 mm
  const Mesh flat = plane(0.0);
  const cv::Mat3b picture = draw_comparison(height_field(-5, 5, -5, 5, 20, slope), flat, kPanelPx);
  ASSERT_EQ(picture.cols, 3 * kPanelPx);
  const auto brightness_at = [&](double share) {
    const int x = 2 * kPanelPx + static_cast<int>(share * kPanelPx);
    const cv::Scalar mean = cv::mean(picture(cv::Rect(x - 4, picture.rows / 2 - 4, 8, 8)));
    return mean[0] + mean[1] + mean[2];
  };
  const double one_side = brightness_at(0.3), middle = brightness_at(0.5), other_side = brightness_at(0.7);
  EXPECT_GT(std::abs(one_side - other_side), 60);
  EXPECT_GT((one_side - middle) * (middle - other_side), 0) << "from pale to dark";
}

TEST_F(MeshPicture, LooksFromWhereTheSurfaceFacesTheViewer) {
  for (const double angle : {0.0, 1.0, 2.5}) {
    Vector6d xi;
    xi << angle, 0.5 * angle, -angle, 3, 4, 5;
    const Mesh tilted = transformed(plane(0.0), se3_exp(xi));
    const cv::Mat3b picture = draw_comparison(tilted, tilted, kPanelPx);
    int covered = 0;
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < kPanelPx; ++x) covered += is_colored(cv::Vec3d(picture(y, x))) ? 1 : 0;
    // On its corner, a little from the side and with room for words, a square covers 0.23 of its panel; from
    // the edge nothing.
    EXPECT_GT(covered, 0.2 * picture.rows * kPanelPx) << angle;
    EXPECT_TRUE(is_colored(panel_color(picture, 0)));
  }
}

TEST_F(MeshPicture, IsTheSameEveryTime) {
  const Mesh bumpy = height_field(-5, 5, -3, 3, 40, &test::bumps);
  const cv::Mat3b a = draw_comparison(bumpy, plane(0.0), kPanelPx),
                  b = draw_comparison(bumpy, plane(0.0), kPanelPx);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0.0);
}

TEST_F(MeshPicture, RefusesAnEmptyMesh) {
  EXPECT_THROW(draw_comparison(Mesh{}, plane(0.0)), Error);
  EXPECT_THROW(draw_comparison(plane(0.0), Mesh{}), Error);
  EXPECT_THROW(draw_mesh(Mesh{}), Error);
}

TEST_F(MeshPicture, ShowsThreeSides) {
  const cv::Mat3b picture = draw_mesh(test::sphere(3.0, 48), kPanelPx);
  EXPECT_EQ(picture.cols, 3 * kPanelPx);
  for (const int panel : {0, 1, 2}) EXPECT_TRUE(is_colored(panel_color(picture, panel))) << panel;
}

TEST_F(MeshPicture, BumpsShowAsLightAndShadow) {
  const auto contrast = [](const Mesh& mesh) {
    const cv::Mat3b picture = draw_mesh(mesh, kPanelPx);
    const cv::Rect middle(kPanelPx + kPanelPx / 3, picture.rows / 3, kPanelPx / 3, picture.rows / 3);
    cv::Scalar mean, deviation;
    cv::meanStdDev(picture(middle), mean, deviation);
    return deviation[1];
  };
  EXPECT_LT(contrast(plane(0.0)), 2.0);
  EXPECT_GT(contrast(height_field(-5, 5, -5, 5, 80, &test::bumps)), 8.0);
}

TEST(WritePicture, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  cv::Mat3b picture(40, 60);
  cv::randu(picture, 0, 255);
  write_picture(folder / "a.png", picture);
  EXPECT_EQ(cv::norm(picture, cv::imread((folder / "a.png").string()), cv::NORM_INF), 0.0);
  EXPECT_EQ(folder.names().size(), 1U);
  EXPECT_THROW(write_picture(folder / "no" / "a.png", picture), Error);
}

}  // namespace
}  // namespace gelslam
