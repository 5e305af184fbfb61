// The window of `gelslam view`, drawn into pictures without a display.
#include "browse/view_window.hpp"

#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "browse/choose_window.hpp"
#include "gelslam/core/run_report.hpp"
#include "scene_fixture.hpp"
#include "temporary_folder.hpp"
#include "view_run.hpp"

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
  /// Turns until the script is through and nothing moves.
  static void play(ViewWindow& loop) {
    for (int i = 1; i < 110; ++i) loop.turn(0.05 * i);
  }
  static std::vector<std::string> words(const ViewWindow& loop) {
    std::vector<std::string> result;
    for (const DrawnText& text : loop.texts()) result.push_back(text.text);
    return result;
  }

  TemporaryFolder folder;
  ViewWindowOptions options;
};

TEST_F(ViewWindowPicture, ARunHasASlider) {
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  loop.turn(1);
  EXPECT_THAT(words(loop), testing::IsSupersetOf({"RUN", "as saved", "Play", "Shading", "Close"}));
  EXPECT_GT(loop.track().width, 500);
}

TEST_F(ViewWindowPicture, AMeshHasNone) {
  ViewWindow loop(load_view(folder / "RUN" / "mesh.ply"), std::nullopt, options);
  loop.turn(1);
  EXPECT_THAT(words(loop), Not(Contains("Play")));
  EXPECT_EQ(loop.track().width, 0);
}

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
  EXPECT_THAT(words(loop), Contains("2.9 s"));
  const auto orange = [](const cv::Mat3b& picture) {
    const cv::Mat3b view = picture.rowRange(60, picture.rows - 140);
    return std::count_if(view.begin(), view.end(), [](const cv::Vec3b& c) { return c[2] > c[0] + 90; });
  };
  EXPECT_LT(orange(saved), 10);
  EXPECT_GT(orange(loop.picture(1.5)), 1000);
}

TEST_F(ViewWindowPicture, AScriptTurnsZoomsAndTakesPictures) {
  options.script =
      "screenshot a.png\ndrag 120 40\nscreenshot b.png\nscroll 4\nkey r\nwait 2\nscreenshot c.png\nkey 3\n"
      "key c\nkey l\nscreenshot d.png\nquit\n";
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  play(loop);
  const auto picture = [&](const char* name) { return cv::Mat3b(cv::imread((folder / name).string())); };
  const cv::Mat3b a = picture("a.png"), b = picture("b.png"), c = picture("c.png"), d = picture("d.png");
  ASSERT_FALSE(a.empty() || b.empty() || c.empty() || d.empty());
  const cv::Rect view(0, 60, 900, 380);
  EXPECT_GT(cv::norm(a(view), b(view), cv::NORM_L1) / view.area(), 3) << "turned";
  EXPECT_LT(cv::norm(a(view), c(view), cv::NORM_L1) / view.area(), 0.5) << "back again";
  EXPECT_GT(cv::mean(d(view))[0], cv::mean(a(view))[0] + 80) << "light";
}

TEST_F(ViewWindowPicture, KeyPWritesAPictureAndSaysWhere) {
  options.script = "key p\nwait 0.2\n";
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  for (int i = 1; i < 20; ++i) loop.turn(0.03 * i);
  EXPECT_THAT(folder.names(), Contains("view_001.png"));
  EXPECT_THAT(words(loop), Contains(HasSubstr("Picture: ")));
}

TEST_F(ViewWindowPicture, AnUntouchedWindowIsNotDrawnAgain) {
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  for (int i = 0; i < 20; ++i) loop.turn(0.1 * i);
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(loop.turn(3 + i));
  loop.host().push({InputEvent::Kind::redraw});
  EXPECT_TRUE(loop.turn(30));
  loop.host().push({InputEvent::Kind::key, GLFW_KEY_G, true});
  EXPECT_TRUE(loop.turn(31));
}

TEST_F(ViewWindowPicture, ASnapshotHasMarksButNoButtons) {
  options.width_px = 640;
  options.height_px = 480;
  options.style.color = SceneColor::height;
  write_view_snapshot(load_view(folder / "RUN"), std::nullopt, options, folder / "s.png");
  EXPECT_EQ(cv::imread((folder / "s.png").string()).size(), cv::Size(640, 480));
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  loop.snapshot();
  EXPECT_THAT(words(loop), Contains("RUN"));
  EXPECT_THAT(words(loop), Contains("height"));
  EXPECT_THAT(words(loop), Not(Contains("Close")));
}

TEST_F(ViewWindowPicture, TwoSurfacesTheirNamesAndTheDistance) {
  options.style.color = SceneColor::distance;
  ViewContent truth = load_view(folder / "RUN" / "mesh.ply");
  truth.name = "truth";
  ViewWindow loop(load_view(folder / "RUN"), truth, options);
  for (int i = 1; i < 10; ++i) loop.turn(0.03 * i);
  EXPECT_THAT(words(loop), testing::IsSupersetOf({"RUN", "truth", "distance", "mean 0.000 mm"}));
  EXPECT_THAT(words(loop), Contains(HasSubstr("90 % below")));
}

TEST_F(ViewWindowPicture, TheBoxSaysHowLargeTheSurfaceIs) {
  ViewWindow loop(load_view(folder / "RUN" / "mesh.ply"), std::nullopt, options);
  loop.turn(1);
  const cv::Mat3b without = loop.picture(1.1);
  loop.controls().perform(Action::box, 1.2);
  const cv::Mat3b with = loop.picture(1.4);
  EXPECT_THAT(words(loop), testing::IsSupersetOf({"8.40 mm", "1.80 mm", "0.00 mm"}));
  EXPECT_GT(cv::norm(without, with, cv::NORM_L1), 1e5);
  if (const char* kept = std::getenv("GELSLAM_PICTURES")) write_png(std::string(kept) + "/box.png", with);
}

TEST_F(ViewWindowPicture, AnotherRunIsOpenedByDropOrFromTheList) {
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  loop.turn(1);
  loop.host().push({InputEvent::Kind::drop, 0, false, 0, 0, "other.ply"});
  loop.turn(1.1);
  EXPECT_TRUE(loop.wants_to_close());
  EXPECT_EQ(loop.controls().end().dropped, "other.ply");
  ViewWindow again(load_view(folder / "RUN"), std::nullopt, options);
  again.turn(1);
  EXPECT_FALSE(again.wants_to_close());
  again.controls().perform(Action::open, 1.1);
  EXPECT_TRUE(again.wants_to_close());
  EXPECT_TRUE(again.controls().end().chooses);
}

TEST_F(ViewWindowPicture, LettersGrowWithTheAskedScale) {
  options.ui_scale = 1.5;
  ViewWindow large(load_view(folder / "RUN"), std::nullopt, options);
  options.ui_scale = 1;
  ViewWindow usual(load_view(folder / "RUN"), std::nullopt, options);
  large.turn(1);
  usual.turn(1);
  EXPECT_NEAR(large.host().ui_scale(), 1.5F * usual.host().ui_scale(), 0.07);
}

TEST_F(ViewWindowPicture, TinyWindowsAndHelpDoNoHarm) {
  options.script = "key h\nresize 300 200\nwait 0.1\nresize 100 100\nwait 0.1\nresize 1600 1200\nwait 0.1\n";
  ViewWindow loop(load_view(folder / "RUN"), std::nullopt, options);
  play(loop);
  EXPECT_THAT(words(loop), Contains("One keyframe back"));
}

TEST_F(ViewWindowPicture, AWrongScriptIsNamed) {
  options.script = "key p\njump 3\n";
  options.script_name = "my.txt";
  EXPECT_THAT(message_of<Error>([&] { ViewWindow(load_view(folder / "RUN"), std::nullopt, options); }),
              HasSubstr("my.txt"));
}

class ChooseWindowPicture : public ViewWindowPicture {
 protected:
  void SetUp() override {
    ViewWindowPicture::SetUp();
    if (IsSkipped()) return;
    namespace fs = std::filesystem;
    std::ofstream(folder / "RUN/report.json") << report_json(RunReport());
    fs::create_directories(folder / "shapes/.hidden");
    for (const char* name : {"shapes/part.stl", "shapes/.hidden/part.stl", "shapes/notes.txt"})
      std::ofstream(folder / name) << "";
    fs::last_write_time(folder / "RUN/report.json", fs::file_time_type::clock::now());
    fs::last_write_time(folder / "shapes/part.stl",
                        fs::file_time_type::clock::now() - std::chrono::hours(24));
  }
  std::optional<std::filesystem::path> chosen(const std::string& script) {
    options.script = script;
    ChooseWindow window(runs_and_meshes(folder.path()), options);
    for (int i = 1; i < 40 && !window.wants_to_close(); ++i) window.turn(0.05 * i);
    return window.chosen();
  }
};

TEST_F(ChooseWindowPicture, ListsRunsAndMeshesTheNewestFirst) {
  std::vector<std::filesystem::path> found;
  for (const Viewable& each : find_viewable(folder.path())) found.push_back(each.path);
  EXPECT_THAT(found, testing::ElementsAre(folder / "RUN", folder / "shapes/part.stl"));
  EXPECT_TRUE(find_viewable(folder / "nowhere").empty());
  std::ofstream(folder / "RUN/log.mkv") << "";
  std::ofstream(folder / "shapes/gelsight.avi") << "";
  std::filesystem::last_write_time(folder / "shapes/gelsight.avi",
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(24));
  found.clear();
  for (const Viewable& each : find_logs(folder.path())) found.push_back(each.path);
  EXPECT_THAT(found, testing::ElementsAre(folder / "RUN/log.mkv", folder / "shapes/gelsight.avi"));
}

TEST_F(ChooseWindowPicture, AClickOrADropChoosesAndQChoosesNothing) {
  EXPECT_EQ(chosen("click shapes/part.stl\n"), folder / "shapes/part.stl");
  EXPECT_EQ(chosen("click RUN\n"), folder / "RUN");
  EXPECT_EQ(chosen("key q\n"), std::nullopt);
  options.script.clear();
  Choices choices = runs_and_meshes(folder.path());
  choices.complaint = "part.stl is damaged";
  ChooseWindow window(choices, options);
  window.host().push({InputEvent::Kind::drop, 0, false, 0, 0, "elsewhere.ply"});
  window.turn(1);
  EXPECT_EQ(window.chosen(), "elsewhere.ply");
  std::vector<std::string> words;
  for (const DrawnText& text : window.texts()) words.push_back(text.text);
  EXPECT_THAT(words, Contains("part.stl is damaged"));
}

TEST_F(ChooseWindowPicture, WhatDoesNotFitIsScrolledTo) {
  for (int i = 0; i < 30; ++i) std::ofstream(folder / ("part" + std::to_string(i) + ".ply")) << "";
  std::filesystem::last_write_time(folder / "part0.ply",
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(100));
  std::string script;
  for (int i = 0; i < 9; ++i) script += "scroll -20\n";
  EXPECT_EQ(chosen(script + "click part0.ply\n"), folder / "part0.ply");
}

}  // namespace
}  // namespace gelslam::test
