#include "gelslam/viewer/view_stage.hpp"

#include <opencv2/imgproc.hpp>

#include "scene_fixture.hpp"
#include "temporary_folder.hpp"
#include "view_run.hpp"

namespace gelslam::test {
namespace {

class ViewStagePicture : public SceneDrawing {
 protected:
  static ViewContent ball(double radius_mm) { return {"ball", sphere(radius_mm, 96), std::nullopt}; }
  /// Columns in which a run's strip of touches shows.
  int width_at(ViewStage& stage, const OrbitCamera& view, std::optional<double> time_s) {
    stage.set_time(time_s);
    SceneStyle bare = style;
    bare.touch = bare.sensor = false;
    return cv::boundingRect(mask_of(stage.picture(view, bare, kWidth, kHeight)).rowRange(60, kHeight - 60))
        .width;
  }
};

TEST_F(ViewStagePicture, TheSurfaceGrowsWithTime) {
  const TemporaryFolder folder;
  write_run(folder / "RUN", 5);
  ViewStage stage(load_view(folder / "RUN"), std::nullopt);
  const OrbitCamera view = stage.first_view(kWhole);
  const double px_per_mm = 1.0 / static_cast<double>(view.mm_per_px(view.distance_mm(), kWhole));
  const int whole = width_at(stage, view, std::nullopt), one = width_at(stage, view, 0.5),
            three = width_at(stage, view, 2.5);
  // Touches are 2.4 mm wide and 1.5 mm apart; the view is a little from the side, a cell of the mesh 0.08 mm.
  EXPECT_NEAR(three - one, 3.0 * px_per_mm, 0.15 * 3.0 * px_per_mm + 3);
  EXPECT_NEAR(whole - three, 3.0 * px_per_mm, 0.25 * 3.0 * px_per_mm + 3);
  EXPECT_EQ(width_at(stage, view, 0.5), one) << "back again";
  EXPECT_EQ(width_at(stage, view, std::nullopt), whole);
  EXPECT_EQ(width_at(stage, view, -1), 0) << "before the first touch";
}

TEST_F(ViewStagePicture, TheTouchOfATimeShowsUntilTheEnd) {
  const TemporaryFolder folder;
  write_run(folder / "RUN", 3);
  ViewStage stage(load_view(folder / "RUN"), std::nullopt);
  const OrbitCamera view = stage.first_view(kWhole);
  const auto orange_at = [&](double time_s) {
    stage.set_time(time_s);
    const cv::Mat3b picture = stage.picture(view, style, kWidth, kHeight);
    return std::count_if(picture.begin(), picture.end(), [](const cv::Vec3b& c) { return c[2] > c[0] + 90; });
  };
  EXPECT_GT(orange_at(1.2), 1000);
  EXPECT_EQ(orange_at(3), 0);
}

TEST_F(ViewStagePicture, FirstViewShowsAllFromOutside) {
  const TemporaryFolder folder;
  write_run(folder / "RUN", 4);
  ViewStage stage(load_view(folder / "RUN"), std::nullopt);
  const OrbitCamera view = stage.first_view(kWhole);
  EXPECT_GT((view.map_R_camera() * Eigen::Vector3f::UnitZ()).dot(-Eigen::Vector3f::UnitZ()), 0.8F);
  const cv::Rect box =
      cv::boundingRect(mask_of(stage.picture(view, style, kWidth, kHeight)).rowRange(60, kHeight - 60));
  EXPECT_GT(box.width, kWidth / 2) << "its long side lies";
  EXPECT_GT(box.x, 0);
  EXPECT_LT(box.br().x, kWidth);
}

TEST_F(ViewStagePicture, BesideEachOtherUnderOneCameraWithDistances) {
  ViewStage stage(ball(5), ball(4.9));
  ASSERT_TRUE(stage.has_second());
  style.color = SceneColor::distance;
  const auto legend = stage.legend(style);
  ASSERT_TRUE(legend);
  EXPECT_FLOAT_EQ(legend->max, 0.2F) << "0.1 mm and a little, by the facets";
  const OrbitCamera view = stage.first_view(kWhole);
  const cv::Mat3b picture = stage.picture(view, style, kWidth, kHeight);
  const auto saturation = [&](int x) {
    const cv::Vec3b c = picture(kHeight / 2, x);
    return *std::max_element(c.val, c.val + 3) - *std::min_element(c.val, c.val + 3);
  };
  EXPECT_GT(saturation(kWidth / 4), 60) << "0.1 mm of 0.2 mm is orange to red";
  EXPECT_LT(saturation(3 * kWidth / 4), 40) << "the second is clay";
  EXPECT_TRUE(stage.pick(view, {kWidth / 4.0F, kHeight / 2.0F}, kWhole));
  EXPECT_TRUE(stage.pick(view, {3 * kWidth / 4.0F, kHeight / 2.0F}, kWhole));
  EXPECT_FALSE(stage.pick(view, {kWidth / 2.0F, 20}, kWhole));
}

TEST_F(ViewStagePicture, TimeMeansNothingToAMesh) {
  ViewStage stage(ball(5), std::nullopt);
  EXPECT_EQ(stage.history(), nullptr);
  const OrbitCamera view = stage.first_view(kWhole);
  const cv::Mat3b before = stage.picture(view, style, kWidth, kHeight);
  stage.set_time(1);
  EXPECT_FALSE(stage.work());
  EXPECT_EQ(largest_difference(stage.picture(view, style, kWidth, kHeight), before), 0);
}

TEST_F(ViewStagePicture, NothingToShowIsStillAPicture) {
  ViewStage stage(ViewContent{"empty", Mesh(), std::nullopt}, std::nullopt);
  EXPECT_EQ(stage.picture(stage.first_view(kWhole), style, 64, 48).rows, 48);
}

}  // namespace
}  // namespace gelslam::test
