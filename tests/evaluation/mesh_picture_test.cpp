#include "gelslam/evaluation/mesh_picture.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "test_meshes.hpp"

namespace gelslam {
namespace {

using test::height_field;
using test::plane;

constexpr PictureOptions kSmall{.panel_width_px = 160, .color_limit_mm = 0.1};

/// The color in the middle of one of the three panels.
cv::Vec3d panel_color(const cv::Mat& picture, int panel) {
  const int x = 10 + panel * (kSmall.panel_width_px + 10) + kSmall.panel_width_px / 2;
  const cv::Scalar mean = cv::mean(picture(cv::Rect(x - 8, picture.rows / 2 - 8, 16, 16)));
  return {mean[0], mean[1], mean[2]};
}

bool is_colored(const cv::Vec3d& bgr) {
  return std::max({bgr[0], bgr[1], bgr[2]}) - std::min({bgr[0], bgr[1], bgr[2]}) > 20.0;
}

TEST(RenderComparison, ColorsFollowTheDistance) {
  const Mesh truth = plane(0.0);
  const cv::Vec3d exact = panel_color(render_comparison(plane(0.0), truth, kSmall), 2);
  const cv::Vec3d middle = panel_color(render_comparison(plane(0.05), truth, kSmall), 2);
  const cv::Vec3d far = panel_color(render_comparison(plane(0.2), truth, kSmall), 2);
  EXPECT_GT(exact[0], exact[2] + 40);    // blue
  EXPECT_GT(middle[1], middle[0] + 40);  // green
  EXPECT_GT(far[2], far[0] + 40);        // red
}

TEST(RenderComparison, LooksFromWhereTheSurfaceFacesTheViewer) {
  Vector6d xi;
  for (const double angle : {0.0, 1.0, 2.5}) {
    xi << angle, 0.5 * angle, -angle, 3, 4, 5;
    const Mesh tilted = transformed(plane(0.0), se3_exp(xi));
    const cv::Mat picture = render_comparison(tilted, tilted, kSmall);
    int covered = 0;
    const int top = 44, height = picture.rows - top - 10;
    for (int y = top; y < top + height; ++y) {
      for (int x = 10; x < 10 + kSmall.panel_width_px; ++x) {
        covered += is_colored(cv::Vec3d(picture.at<cv::Vec3b>(y, x))) ? 1 : 0;
      }
    }
    // A square fills 77 % of its panel when seen from the front with its sides upright, half of that on its
    // corner.
    EXPECT_GT(covered, 0.35 * height * kSmall.panel_width_px) << angle;
    EXPECT_TRUE(is_colored(panel_color(picture, 0)));
  }
}

TEST(RenderComparison, IsTheSameEveryTime) {
  const Mesh bumpy = height_field(-5, 5, -3, 3, 40, &test::bumps);
  const cv::Mat a = render_comparison(bumpy, plane(0.0), kSmall),
                b = render_comparison(bumpy, plane(0.0), kSmall);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(cv::norm(a, b, cv::NORM_INF), 0.0);
}

TEST(RenderComparison, RefusesAnEmptyMesh) {
  EXPECT_THROW(render_comparison(Mesh{}, plane(0.0), kSmall), Error);
  EXPECT_THROW(render_comparison(plane(0.0), Mesh{}, kSmall), Error);
}

TEST(RenderMeshPicture, HasOnePanelPerView) {
  const Mesh ball = test::sphere(3.0, 48);
  int width = 0;
  for (const int views : {1, 2, 3}) {
    const cv::Mat picture = render_mesh_picture(ball, views, kSmall);
    EXPECT_EQ(picture.cols - width, views == 1 ? kSmall.panel_width_px + 20 : kSmall.panel_width_px + 10);
    width = picture.cols;
    const cv::Vec3b& last = picture.at<cv::Vec3b>(picture.rows / 2, width - 10 - kSmall.panel_width_px / 2);
    EXPECT_TRUE(is_colored(cv::Vec3d(last)));
  }
}

TEST(RenderMeshPicture, BumpsShowAsLightAndShadow) {
  const auto contrast = [](const Mesh& mesh) {
    const cv::Mat picture = render_mesh_picture(mesh, 1, kSmall);
    const cv::Rect middle(picture.cols / 3, picture.rows / 3, picture.cols / 3, picture.rows / 3);
    cv::Scalar mean, deviation;
    cv::meanStdDev(picture(middle), mean, deviation);
    return deviation[1];
  };
  EXPECT_LT(contrast(plane(0.0)), 1.0);
  EXPECT_GT(contrast(height_field(-5, 5, -5, 5, 80, &test::bumps)), 8.0);
}

TEST(WritePicture, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  const cv::Mat picture = render_mesh_picture(plane(0.0), 1, kSmall);
  write_picture(folder / "a.png", picture);
  EXPECT_EQ(cv::norm(picture, cv::imread((folder / "a.png").string()), cv::NORM_INF), 0.0);
  EXPECT_EQ(folder.names().size(), 1U);
  EXPECT_THROW(write_picture(folder / "no" / "a.png", picture), Error);
}

}  // namespace
}  // namespace gelslam
