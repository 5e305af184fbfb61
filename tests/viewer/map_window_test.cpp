// The window of a sensor in a known map, drawn into pictures without a display.

#include "locate/map_window.hpp"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include "../support/round_touch.hpp"
#include "window_pictures.hpp"

namespace gelslam::test {
namespace {

using namespace viewer;
using namespace viewer::detail;

/// A plate of 40 x 30 x 4 mm; its upper side looks along -z.
Mesh plate() {
  Mesh mesh;
  for (const float z : {0.0F, 4.0F})
    for (const auto& [x, y] : {std::pair(-20.0F, -15.0F), {20.0F, -15.0F}, {20.0F, 15.0F}, {-20.0F, 15.0F}})
      mesh.vertices_mm.emplace_back(x, y, z);
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
  return mesh;
}

/// On the upper side of the plate, or on the lower one.
PlaceHypothesis at(double x, double y, double probability, bool above = true) {
  PlaceHypothesis place;
  if (!above) place.map_T_sensor.pose = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX());
  place.map_T_sensor.pose.translation() = Eigen::Vector3d(x, y, above ? 0 : 4);
  place.map_T_sensor.covariance =
      Vector6d(1e-6, 1e-6, 4e-6, 1e-4, 1e-4, 4e-4).asDiagonal();  // 0.02 mm, 0.11 degrees
  place.probability = probability;
  return place;
}

class OpenWindow : public MapWindow {
 public:
  using MapWindow::MapWindow;
  Eigen::Vector2f pixel_of(const Eigen::Vector3d& p_mm) const {
    return on_screen(viewport(), p_mm.cast<float>()).value();
  }
};

class MapWindowPicture : public testing::Test {
 protected:
  void SetUp() override {
    if (!can_draw()) GTEST_SKIP() << "no OpenGL here, not even without a display";
    WindowOptions options;
    options.visible = false;
    options.width_px = 900;
    options.height_px = 620;
    window_ = std::make_unique<OpenWindow>(map_, touches_, options);
    window_->turn(0, true);
  }
  void put(PlaceStatus status, std::vector<PlaceHypothesis> places, const std::string& reason = "",
           TrackStatus track = TrackStatus::tracked) {
    auto touch = std::make_shared<FrameReport>();
    touch->surface = round_touch(0);
    touch->image = cv::Mat3b(120, 160, cv::Vec3b(90, 120, 60));
    touch->tracked.status = track;
    touch->localization = Localization{status, std::move(places), reason};
    touches_.newest = touch;
  }
  cv::Mat3b picture(const std::string& name) {
    for (int i = 0; i < 5; ++i) window_->turn(now_s_ += 0.1);
    window_->turn_to_touch();
    return kept(window_->picture(now_s_ += 0.02), name);
  }
  bool shows(const std::string& text, Color color) const {
    return std::any_of(window_->texts().begin(), window_->texts().end(),
                       [&](const DrawnText& t) { return t.text == text && t.color == color; });
  }
  /// How much redder than blue the picture is in the middle of a touch.
  int glow(const cv::Mat3b& picture, const PlaceHypothesis& place) const {
    const Eigen::Vector2f p = window_->pixel_of(place.map_T_sensor.pose.translation());
    const cv::Vec3b color = picture(cvRound(p.y()), cvRound(p.x()));
    return color[2] - color[0];
  }

  const ShownMap map_{"plate", plate()};
  LocatedTouches touches_;
  std::unique_ptr<OpenWindow> window_;
  double now_s_ = 0;
};

TEST_F(MapWindowPicture, TheMapIsGrayAndTheTouchGlowsAtItsPlace) {
  EXPECT_TRUE((picture("map_0"), shows("Getting ready", theme::kBlue)));
  const PlaceHypothesis place = at(11, -4, 0.99), elsewhere = at(-9, 6, 0);
  put(PlaceStatus::localized, {place});
  const cv::Mat3b shown = picture("map_1");
  EXPECT_TRUE(shows("Localized", theme::kGreen));
  EXPECT_TRUE(shows("99 %", theme::kText));
  EXPECT_TRUE(shows("σ 0.020 mm, 0.11°", theme::kText));
  EXPECT_GT(glow(shown, place), 60);
  EXPECT_LT(glow(shown, elsewhere), 4) << "gray, not of clay";
  const Eigen::Vector2f p = window_->pixel_of(elsewhere.map_T_sensor.pose.translation());
  EXPECT_GT(shown(cvRound(p.y()), cvRound(p.x()))[1], 80) << "the map, brighter than what is behind it";
}

TEST_F(MapWindowPicture, SeveralPlacesAreGhostsAsFaintAsTheyAreImprobable) {
  const PlaceHypothesis likely = at(11, -4, 0.6), unlikely = at(-9, 6, 0.25), never = at(0, -10, 0);
  put(PlaceStatus::ambiguous, {likely, unlikely}, "several places of the map look like this touch");
  const cv::Mat3b shown = picture("map_2");
  EXPECT_TRUE(shows("Ambiguous, 2 places", theme::kAmber));
  EXPECT_TRUE(shows("Several places of the map look like this touch.", theme::kText));
  for (const char* share : {"60 %", "25 %", "15 %"}) EXPECT_TRUE(shows(share, theme::kText)) << share;
  EXPECT_GT(glow(shown, likely), glow(shown, unlikely) + 20);
  EXPECT_GT(glow(shown, unlikely), glow(shown, never) + 20);
  put(PlaceStatus::localized, {likely});
  EXPECT_GT(glow(picture("map_3"), likely), glow(shown, likely) + 10) << "no ghost any more";
}

TEST_F(MapWindowPicture, TheTouchedSideTurnsToTheViewerUnlessAnotherPlaceIsSeen) {
  const PlaceHypothesis above = at(6, 2, 0.5), below = at(-6, 2, 0.5, false);
  put(PlaceStatus::localized, {below});
  EXPECT_GT(glow(picture("map_4"), below), 60);
  put(PlaceStatus::ambiguous, {above, below});
  const cv::Mat3b shown = picture("map_5");
  EXPECT_GT(glow(shown, below), 30);
  EXPECT_GT(glow(shown, below), glow(shown, above) + 15) << "behind the plate";
  EXPECT_GT(glow(shown, above), 5) << "through it";
  window_->host().push({InputEvent::Kind::key, GLFW_KEY_F, true});
  put(PlaceStatus::localized, {above});
  EXPECT_LT(glow(picture("map_6"), above), 15) << "the view stays where it is";
}

}  // namespace
}  // namespace gelslam::test
