// The program on the real recordings of data/real: what its README expects of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "../support/data_folder.hpp"
#include "../support/run_program.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

class RealRecordings : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(real)) GTEST_SKIP() << "no " << real << "; set GELSLAM_DATA";
    test::write_bytes(folder / "dots.yaml",
                      "device_config:\n  ppmm: 0.0453\n  raw_imgw: 320\n  raw_imgh: 240\n");
  }

  /// One JSON object for every frame.
  std::vector<nlohmann::json> track(const fs::path& log, std::vector<std::string> options) const {
    std::vector<std::string> words{"track", log.string(), "--format", "ndjson"};
    words.insert(words.end(), options.begin(), options.end());
    const test::ProgramResult result = test::gelslam(words);
    EXPECT_LE(result.exit_code, 1) << log << ": " << result.err;
    std::vector<nlohmann::json> frames;
    for (const std::string& line : test::lines_of(result.out)) {
      nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
      if (json.is_object() && json.contains("status")) frames.push_back(std::move(json));
    }
    return frames;
  }

  /// Of a gel with dots, of which 0.0453 mm are a pixel.
  std::vector<std::string> dotted(const fs::path& background) const {
    return {"--model",  (real / "nnmini.pt").string(),  "--background", background.string(),
            "--config", (folder / "dots.yaml").string()};
  }

  /// Of a video, one part in so many: what comes later is more of the same.
  fs::path beginning_of(const fs::path& video, std::size_t parts) const {
    const std::string bytes = test::read_bytes(video);
    test::write_bytes(folder / "short.avi", bytes.substr(0, bytes.size() / parts));
    return folder / "short.avi";
  }

  static double most_contact_px(const std::vector<nlohmann::json>& frames, int first, double pitch_mm) {
    double most = 0;
    for (const nlohmann::json& frame : frames)
      if (frame.at("frame") >= first && frame.at("contact").is_object())
        most = std::max(most, frame.at("contact").at("area_mm2").get<double>() / (pitch_mm * pitch_mm));
    return most;
  }

  const fs::path data = test::data_folder(), real = data / "real";
  const test::TemporaryFolder folder;
};

TEST_F(RealRecordings, AFingerIsTrackedHoweverItsClipIsEncoded) {
  for (const char* clip : {"finger.avi", "finger_x264.mp4"}) {
    const auto frames =
        track(real / "finger" / clip, {"--model", (data / "calibration/model/nnmodel.pth").string()});
    const auto tracked = std::count_if(frames.begin(), frames.end(),
                                       [](const nlohmann::json& f) { return f.at("status") == "tracked"; });
    EXPECT_EQ(frames.size(), 306U) << clip;
    EXPECT_GE(tracked, 200) << clip;
    // A person counts 15 000 of its tip; for eight frames it lies flat, and as much as 27 100 is pressed.
    EXPECT_LT(most_contact_px(frames, 0, 0.0634), 28'000) << clip;
  }
}

TEST_F(RealRecordings, BareGelBesideASmallTouchIsNoContact) {
  // Frames from which on the object is there, and pixels that touch by eye, with a margin.
  const std::map<std::string, std::pair<int, int>> touched{{"wooden_statue_4", {10, 12'000}},
                                                           {"tin_box_1", {18, 27'000}}};
  for (const auto& [name, limit] : touched) {
    const fs::path log = real / "bare_gel" / (name + "_right.avi");
    const auto frames = track(log, dotted(real / "bare_gel" / (name + "_background.png")));
    ASSERT_GT(frames.size(), 100U) << name;
    EXPECT_LT(most_contact_px(frames, limit.first, 0.0453), limit.second) << name;
  }
}

/// About 56 frames of three logs of two fingers each.
TEST_F(RealRecordings, WhatTwoFingersHoldIsTrackedAndBareGelIsNot) {
  test::write_bytes(folder / "long.yaml", "device_config:\n  ppmm: 0.0634\n");
  for (const char* name : {"cellotape_7", "screw_driver_blue_gray_1", "walnut_1"}) {
    for (const std::string side : {"left", "right"}) {
      const fs::path pair = real / "pairs" / name;
      const auto frames = track(
          beginning_of(pair / (side + ".avi"), 8),
          {"--model", (real / "nnmini.pt").string(), "--background",
           (pair / ("background_" + side + ".png")).string(), "--config", (folder / "long.yaml").string()});
      EXPECT_GT(frames.size(), 40U) << name << " " << side;
      const auto in_first_trial = std::ranges::count_if(
          frames, [](const auto& f) { return f.at("status") == "tracked" && f.at("trial") == 0; });
      EXPECT_GE(static_cast<double>(in_first_trial), 0.9 * static_cast<double>(frames.size()))
          << name << " " << side;
      EXPECT_LT(most_contact_px(frames, 0, 0.0634), 0.4 * 320 * 240) << name << " " << side;
    }
  }
}

/// They are shaken by up to 0.7 mm per frame.
TEST_F(RealRecordings, AHeldObjectStaysInOneTrial) {
  for (const char* name : {"tin_box_2", "wooden_statue_1"}) {
    const fs::path pair = real / "pairs" / name;
    const auto facts = nlohmann::json::parse(test::read_bytes(pair / "pair.json"));
    const int start = facts.at("start"), end = facts.at("end");
    for (const std::string side : {"left", "right"}) {
      std::map<int, int> frames_of_trial;
      for (const auto& frame :
           track(pair / (side + ".avi"), dotted(pair / ("background_" + side + ".png")))) {
        const int at = frame.at("frame");
        if (start <= at && at <= end && frame.at("status") == "tracked") ++frames_of_trial[frame.at("trial")];
      }
      int longest = 0;
      for (const auto& [trial, frames] : frames_of_trial) longest = std::max(longest, frames);
      EXPECT_GE(longest, 0.9 * (end - start + 1)) << name << " " << side;
    }
  }
}

TEST_F(RealRecordings, AMeshOfOneLargeAndManyTinyTrianglesIsClosedInSeconds) {
  const fs::path mesh = folder / "closed.ply";
  const test::ProgramResult result =
      test::gelslam({"export", (real / "faults/sliver.ply").string(), "--watertight", "-o", mesh.string()});
  EXPECT_LE(result.exit_code, 1) << result.err;
  EXPECT_TRUE(fs::exists(mesh));
}

/// Their first pictures are dark, or old ones from the camera's buffers. When the object comes was seen by
/// eye; before, the gel is bare.
TEST_F(RealRecordings, NoBareGelIsTrackedAfterABadStart) {
  const std::map<std::string, int> touched_at{
      {"blue_mug_1", 19}, {"cheese_tube_3", 27}, {"jute_basket_2", 34},   {"marker_pen_3", 30},
      {"tin_box_1", 18},  {"usb_hub_1", 33},     {"wooden_giraffe_3", 33}};
  for (const auto& [name, touch] : touched_at) {
    const auto frames =
        track(real / "bad_starts" / (name + "_camera_0.avi"),
              {"--model", (real / "nnmini.pt").string(), "--config", (folder / "dots.yaml").string()});
    EXPECT_GT(frames.size(), static_cast<std::size_t>(touch)) << name;
    for (const nlohmann::json& frame : frames) {
      if (frame.at("frame") >= touch) break;
      EXPECT_NE(frame.at("status"), "tracked") << name << " " << frame.at("frame");
    }
  }
}

TEST_F(RealRecordings, ABackgroundCanBeNamed) {
  const auto frames = track(real / "bad_starts/tin_box_1_camera_0.avi",
                            {"--model", (real / "nnmini.pt").string(), "--config",
                             (folder / "dots.yaml").string(), "--background-frames", "5-9"});
  ASSERT_GT(frames.size(), 100U);
  EXPECT_EQ(frames[9].at("status"), "background");
  EXPECT_EQ(frames[10].at("status"), "no_contact");
}

/// Of a hand that rolls a peanut: dithered, 15 Hz, several degrees per frame.
TEST_F(RealRecordings, APeanutIsOneMapWithNearlyEveryFrameInIt) {
  const test::ProgramResult result = test::gelslam(
      {"reconstruct", (data / "clips/peanut").string(), "-o", (folder / "run").string(), "--config",
       GELSLAM_CLIP_CONFIG, "--background", (data / "clips/background.png").string(), "--model",
       (data / "calibration/model/nnmodel.pth").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(test::read_bytes(folder / "run/report.json"));
  EXPECT_LE(report.at("frames").at("not_in_mesh"), 1)
      << "contact nearly fades at frame 61, and is recognized again";
  EXPECT_GE(report.at("frames").at("in_map"), 100) << "of 109, one without contact; five or six jumps of the "
                                                      "sped up clip fit nowhere, or at several places";
}

// Slopes that are read steeper or flatter have more noise or less, and every limit goes with it: only poses
// and heights scale.
TEST_F(RealRecordings, AModelOfAnotherScaleTracksTheSameFrames) {
  const fs::path pair = real / "pairs/wooden_statue_2", rendered = real / "../sequences/track_pebble";
  const auto expect_same = [&](const fs::path& log, const fs::path& model, std::vector<std::string> options) {
    const auto tracked_through = [&](float scale) {
      ModelFile file = read_model_file(model);
      for (float& number : file.model.slope_matrix) number *= scale;
      write_model_file(folder / "scaled.json", file);
      std::vector<std::string> words = options;
      words.insert(words.end(), {"--model", (folder / "scaled.json").string()});
      std::array<std::int64_t, 2> frames_and_trials{};
      for (const nlohmann::json& frame : track(log, words)) {
        if (frame.at("status") != "tracked") continue;
        ++frames_and_trials[0];
        frames_and_trials[1] = std::max(frames_and_trials[1], frame.at("trial").get<std::int64_t>());
      }
      return frames_and_trials;
    };
    const auto [frames, trials] = tracked_through(1);
    EXPECT_GT(frames, 50);
    for (const float scale : {0.7F, 1.4F}) {
      const auto [scaled_frames, scaled_trials] = tracked_through(scale);
      EXPECT_NEAR(static_cast<double>(scaled_frames), static_cast<double>(frames),
                  0.02 * static_cast<double>(frames))
          << log << " " << scale;
      EXPECT_NEAR(static_cast<double>(scaled_trials), static_cast<double>(trials), 1) << log << " " << scale;
    }
  };
  expect_same(rendered, real / "../calibration_sim/model/nnmodel.pth", {});
  expect_same(
      pair / "left.avi", real / "nnmini.pt",
      {"--background", (pair / "background_left.png").string(), "--config", (folder / "dots.yaml").string()});
}

}  // namespace
}  // namespace gelslam
