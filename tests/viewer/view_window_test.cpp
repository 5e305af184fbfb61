// The window of `gelslam view`, drawn into pictures without a display.
#include "browse/view_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "scene_fixture.hpp"
#include "temporary_folder.hpp"
#include "view_run.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using namespace viewer;
using namespace viewer::detail;

class ViewWindowPicture : public SceneDrawing {
 protected:
  void SetUp() override {
    SceneDrawing::SetUp();
    if (IsSkipped()) return;
    write_run(folder / "RUN", 5);
    options.visible = false;
    options.width_px = 900;
    options.height_px = 600;
    options.picture_folder = folder.path();
  }

  TemporaryFolder folder;
  ViewWindowOptions options;
};

TEST_F(ViewWindowPicture, PressingTheSliderSetsTheTimeAndTheTouchFollows) {
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  loop.turn(1);
  const cv::Mat3b saved = loop.picture(1.1);
  const Box track = loop.track();
  loop.host().push(
      {InputEvent::Kind::pointer, 0, false, track.x + 0.3 * track.width, track.y + 0.5 * track.height});
  loop.host().push({InputEvent::Kind::button, 0, true});
  loop.turn(1.2);
  ASSERT_TRUE(loop.controls().time_s());
  EXPECT_NEAR(*loop.controls().time_s(), 0.3 * 4.9, 0.02);
  loop.host().push({InputEvent::Kind::pointer, 0, false, track.x + 0.6 * track.width, 5});  // still held
  loop.turn(1.3);
  EXPECT_NEAR(*loop.controls().time_s(), 0.6 * 4.9, 0.02);
  loop.host().push({InputEvent::Kind::button, 0, false});
  loop.turn(1.4);
  EXPECT_THAT(words_of(loop), Contains("2.9 s"));
  const auto orange = [](const cv::Mat3b& picture) {
    const cv::Mat3b view = picture.rowRange(60, picture.rows - 140);
    return std::count_if(view.begin(), view.end(), [](const cv::Vec3b& c) { return c[2] > c[0] + 90; });
  };
  EXPECT_LT(orange(saved), 10);
  EXPECT_GT(orange(loop.picture(1.5)), 1000);
}

TEST_F(ViewWindowPicture, WhatIsNotInTheMeshIsTintedBlueOnDemand) {
  const ViewContent run = load_view(folder / "RUN");
  ViewContent half = run;
  std::vector<Eigen::Vector3i> triangles = run.mesh.triangles;
  std::erase_if(triangles,
                [&](const auto& t) { return run.mesh.vertices_mm[static_cast<std::size_t>(t[0])].x() > 3; });
  half.mesh = submesh(run.mesh, triangles);
  const auto blue_after = [](ViewWindow& loop, int keys) {
    for (; keys > 0; --keys) loop.controls().press_key(GLFW_KEY_M, 1);
    const cv::Mat3b picture = loop.picture(1), view = picture.rowRange(60, picture.rows - 140);
    return std::count_if(view.begin(), view.end(), [](const cv::Vec3b& c) { return c[0] > c[2] + 40; });
  };
  ViewWindow loop(half, std::nullopt, options);
  EXPECT_LT(blue_after(loop, 0), 10);
  EXPECT_GT(blue_after(loop, 1), 1000);
  EXPECT_LT(blue_after(loop, 1), 10);
}

TEST_F(ViewWindowPicture, ASnapshotHasMarksButNoButtons) {
  options.width_px = 640;
  options.height_px = 480;
  options.style.color = SceneColor::height;
  write_view_snapshot(load_view(folder / "RUN"), std::nullopt, options, folder / "s.png");
  EXPECT_EQ(cv::imread((folder / "s.png").string()).size(), cv::Size(640, 480));
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  loop.snapshot();
  EXPECT_THAT(words_of(loop), Contains("RUN"));
  EXPECT_THAT(words_of(loop), Contains("height"));
  EXPECT_THAT(words_of(loop), Not(Contains("Close")));
}

TEST_F(ViewWindowPicture, TwoSurfacesTheirNamesAndTheDistance) {
  options.style.color = SceneColor::distance;
  ViewContent truth = load_view(folder / "RUN" / "mesh.ply");
  truth.name = "truth";
  ViewWindow loop(load_view(folder / "RUN"), truth, options);
  for (int i = 1; i < 10; ++i) loop.turn(0.03 * i);
  EXPECT_THAT(words_of(loop), testing::IsSupersetOf({"RUN", "truth", "distance", "mean 0.000 mm"}));
  EXPECT_THAT(words_of(loop), Contains(HasSubstr("90 % below")));
}

}  // namespace
}  // namespace gelslam::test
