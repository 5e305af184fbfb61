#include <fmt/core.h>
#include <gmock/gmock.h>

#include "browse/view_window.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"
#include "scene_fixture.hpp"
#include "view_run.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using viewer::detail::ViewWindow;

class ViewDistances : public SceneDrawing {
 protected:
  ViewDistances() {
    options.visible = false;
    options.width_px = kWidth;
    options.height_px = kHeight;
    options.style.color = SceneColor::distance;
  }
  ViewWindowOptions options;
};

TEST_F(ViewDistances, BesideEachOtherUnderOneCameraWithDistances) {
  ViewWindow window({"ball", sphere(5, 96), std::nullopt}, ViewContent{"ball", sphere(4.9, 96), std::nullopt},
                    options);
  const cv::Mat3b picture = window.snapshot();
  const auto saturation = [&](int x) {
    const cv::Vec3b c = picture(kHeight / 2, x);
    return *std::max_element(c.val, c.val + 3) - *std::min_element(c.val, c.val + 3);
  };
  EXPECT_GT(saturation(kWidth / 4), 60) << "0.1 mm of 0.2 mm is orange to red";
  EXPECT_LT(saturation(3 * kWidth / 4), 40) << "the second is clay";
}

TEST_F(ViewDistances, DistancesAreThoseThatEvaluateSays) {
  // Half of its area is fine and 0.1 mm away, half of it coarse and 0.3 mm.
  Mesh steps;
  const auto add_plate = [&](float x_mm, float z_mm, int cells) {
    const int first = static_cast<int>(steps.vertices_mm.size()), row = cells + 1;
    for (int i = 0; i < row * row; ++i)
      steps.vertices_mm.emplace_back(x_mm + 5.0F * static_cast<float>(i % row) / static_cast<float>(cells),
                                     5.0F * static_cast<float>(i / row) / static_cast<float>(cells), z_mm);
    for (int i = 0; i < cells * cells; ++i) {
      const int corner = first + i / cells * row + i % cells;
      steps.triangles.emplace_back(corner, corner + 1, corner + row);
      steps.triangles.emplace_back(corner + 1, corner + row + 1, corner + row);
    }
  };
  add_plate(0, 0.1F, 50);
  add_plate(5, 0.3F, 1);
  Mesh plane;
  plane.vertices_mm = {{-10, -10, 0}, {20, -10, 0}, {20, 20, 0}, {-10, 20, 0}};
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  const DistanceSummary said =
      evaluate_mesh(TriangleScene(steps), TriangleScene(plane), {{0, 0, 0}}).accuracy;
  EXPECT_NEAR(said.mean_mm, 0.2, 1e-3);
  options.height_px = 600;  // room for a legend
  ViewWindow window({"steps", steps, std::nullopt}, ViewContent{"plane", plane, std::nullopt}, options);
  window.snapshot();
  EXPECT_THAT(words_of(window), testing::IsSupersetOf({fmt::format("mean {:.3f} mm", said.mean_mm),
                                                       fmt::format("90 % below {:.3f} mm", said.p90_mm)}));
}

}  // namespace
}  // namespace gelslam::test
