#include "gelslam/sensor/frame_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "../support/pictures.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/sensor/raw_log.hpp"

namespace gelslam::test {
namespace {

/// A sensor with few pixels, so that the tests are quick.
SensorProfile small_sensor() {
  SensorProfile profile;
  profile.width_px = 64;
  profile.height_px = 48;
  profile.frame_rate_hz = 50.0;
  return profile;
}

struct Played {
  std::vector<std::int64_t> frames;  ///< their numbers in the log
  std::vector<int> numbers;          ///< that their pictures show
  std::vector<double> times_s;
  std::string warning;
};

/// Everything a source gives, with what must hold for every frame checked on the way.
Played play(const fs::path& log) {
  const auto source = open_frame_source(log, small_sensor());
  Played played;
  while (const auto frame = source->next()) {
    EXPECT_EQ(frame->bgr.size(), cv::Size(64, 48));
    EXPECT_TRUE(played.times_s.empty() || frame->time_s > played.times_s.back());
    played.frames.push_back(frame->index);
    played.numbers.push_back(number_in(frame->bgr));
    played.times_s.push_back(frame->time_s);
  }
  EXPECT_FALSE(source->next().has_value()) << "the end stays the end";
  played.warning = source->warning();
  return played;
}

/// Of a log of numbered pictures at 25 Hz: those that are left keep their places.
void expect_in_place(const Played& played) {
  for (std::size_t i = 0; i < played.frames.size(); ++i) {
    EXPECT_EQ(played.numbers[i], played.frames[i]);
    EXPECT_NEAR(played.times_s[i], 0.04 * static_cast<double>(played.frames[i]), 1e-3);
  }
}

void write_pictures(const TemporaryFolder& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) cv::imwrite((folder / name).string(), numbered_picture(1, 64, 48));
}

std::string error_of(const fs::path& log) {
  return message_of([&] {
    const auto source = open_frame_source(log, small_sensor());
    while (source->next()) {
    }
  });
}

/// The same JPEG pictures in every container; frame 3 is zeroed, the second half of frame 7.
TEST(EveryInput, DamagedPicturesAreLeftOutAndSaidAlike) {
  TemporaryFolder folder;
  fs::create_directory(folder / "images");
  LogWriter writer(folder / "log.mkv", {}, 25);
  write_video(folder / "video.avi", "MJPG", 12, 64, 48);
  std::string avi = read_bytes(folder / "video.avi");
  std::size_t at = 0;
  const auto video = open_raw_log(folder / "video.avi");
  EXPECT_NEAR(video->rate_hz(), 25.0, 1e-6);
  EXPECT_EQ(video->frame_count().value_or(-1), 12);
  EXPECT_THAT(video->description(), HasSubstr("video.avi, 64x48, 25 Hz"));
  while (std::optional<RawFrame> frame = video->next()) {
    const std::string whole(frame->bytes.begin(), frame->bytes.end());
    at = avi.find(whole, at);
    ASSERT_NE(at, std::string::npos) << "a video hands on its JPEGs as they are";
    if (frame->index == 3) std::fill(frame->bytes.begin(), frame->bytes.end(), std::uint8_t{0});
    if (frame->index == 7)
      std::fill(frame->bytes.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2), frame->bytes.end(),
                std::uint8_t{0});
    const std::string bytes(frame->bytes.begin(), frame->bytes.end());
    avi.replace(at, bytes.size(), bytes);
    write_bytes(folder / ("images/" + std::to_string(frame->index) + ".jpg"), bytes);
    ASSERT_TRUE(writer.write(*frame));
  }
  writer.close();
  write_bytes(folder / "video.avi", avi);
  for (const char* name : {"video.avi", "log.mkv"}) {
    const Played seen = play(folder / name);
    EXPECT_THAT(seen.frames, ElementsAre(0, 1, 2, 4, 5, 6, 8, 9, 10, 11)) << name;
    expect_in_place(seen);
    EXPECT_EQ(seen.warning, "left out 2 damaged pictures (the first: " + (folder / name).string() +
                                ", frame 3: the bytes are no JPEG)");
  }
  const Played images = play(folder / "images");
  EXPECT_EQ(images.frames, std::vector<std::int64_t>(images.numbers.begin(), images.numbers.end()));
  EXPECT_THAT(images.numbers, ElementsAre(0, 1, 2, 4, 5, 6, 8, 9, 10, 11));
  EXPECT_THAT(images.warning, HasSubstr("left out 2 damaged pictures (the first: "));
  EXPECT_THAT(images.warning, HasSubstr("3.jpg: not a readable image"));
}

/// What libav decodes: the pictures around the damage are used, in their places. (FFV1 and HuffYUV of OpenCV
/// have no checksums: any bytes are a picture.)
TEST(EveryInput, ADamagedPacketOfAnotherCodecEndsNoVideo) {
  TemporaryFolder folder;
  for (const auto& [name, codec] : {std::pair{"a.avi", "XVID"}, {"b.avi", "DIVX"}}) {
    try {
      write_video(folder / name, codec, 16, 64, 48);
    } catch (const std::runtime_error&) {
      continue;  // this build of FFmpeg cannot encode it
    }
    std::string bytes = read_bytes(folder / name);
    std::size_t at = bytes.find("movi");
    for (int chunk = 0; chunk < 6; ++chunk) at = bytes.find("00dc", at + 4);
    ASSERT_NE(at, std::string::npos);
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + at + 4, sizeof size);
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8, size, '\0');
    write_bytes(folder / name, bytes);
    const Played seen = play(folder / name);
    expect_in_place(seen);
    EXPECT_GE(seen.frames.size(), 6u) << name;
    EXPECT_EQ(seen.frames.back(), 15) << name;
    EXPECT_THAT(seen.warning, HasSubstr("damaged picture")) << name;
  }
}

TEST(VideoSource, TruncatedFileGivesWhatIsThere) {
  TemporaryFolder folder;
  for (const char* name : {"a.avi", "a.mkv"}) {
    write_video(folder / name, "MJPG", 16, 64, 48);
    const std::string bytes = read_bytes(folder / name);
    write_bytes(folder / name, bytes.substr(0, bytes.size() * 6 / 10));
    testing::internal::CaptureStderr();
    const Played played = play(folder / name);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name;
    ASSERT_GE(played.numbers.size(), 5u) << name;
    ASSERT_LT(played.numbers.size(), 12u) << name;
    expect_in_place(played);
    EXPECT_THAT(played.warning, HasSubstr("ends after " + std::to_string(played.numbers.size()))) << name;
  }
}

TEST(VideoSource, WhatIsNoVideoIsNamed) {
  TemporaryFolder folder;
  write_video(folder / "other.avi", "MJPG", 4, 64, 48);  // which lists name
  const std::string no_video = "not a video that can be read";
  testing::internal::CaptureStderr();
  for (const auto& [name, bytes, words] : std::vector<std::array<std::string, 3>>{
           {"empty.avi", "", "the file is empty"},
           {"text.avi", "this is no video\n", no_video},
           {"lfs.mkv", std::string(kLfsPointer), kLfsAdvice},
           {"list.avi", "#EXTM3U\n#EXTINF:1,\n/etc/passwd\n", no_video},
           {"list_with_zero.avi", std::string("#EXTM3U\n#EXTINF:1,\nother.avi\n\0", 31), no_video},
           {"concat.avi", "ffconcat version 1.0\nfile other.avi\n", no_video},
           {"noise.avi", std::string("\0\1\2\3", 4) + std::string(3000, '\xa7'), no_video},
           {"a.mcap", "\x89MCAP0\r\n and more", "an MCAP file; play it (ros2 bag play BAG)"},
           {"a.bag", "#ROSBAG V2.0\n", "a bag of ROS 1; play it (rosbag play BAG)"},
           {"a.h5", "\x89HDF\r\n\x1a\n and more", "an HDF5 file; save its pictures"}}) {
    write_bytes(folder / name, bytes);
    EXPECT_THAT(error_of(folder / name), HasSubstr(name + ": " + words));
  }
  cv::imwrite(folder / "one.png", numbered_picture(0, 64, 48));
  EXPECT_THAT(error_of(folder / "one.png"), HasSubstr("a single image; give the folder"));
  EXPECT_THAT(error_of(folder / "none.avi"), HasSubstr("none.avi: no such file or folder"));
  EXPECT_THAT(error_of("/dev/null"), HasSubstr("neither a file nor a folder"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(EveryInput, FoldersOfRoboticsAreNamedWithTheWayToTheirPictures) {
  TemporaryFolder folder;
  for (const char* made : {"bag2", "lerobot/meta", "lerobot/videos/front"})
    fs::create_directories(folder / made);
  write_bytes(folder / "bag2/metadata.yaml", "rosbag2_bagfile_information:\n");
  write_bytes(folder / "lerobot/meta/info.json", "{}");
  write_bytes(folder / "lerobot/videos/front/0.mp4", "");
  EXPECT_THAT(error_of(folder / "bag2"), HasSubstr("bag2: a bag of ROS 2; play it"));
  EXPECT_THAT(
      error_of(folder / "lerobot"),
      testing::MatchesRegex(".*lerobot: a LeRobot data set; give one of its videos, as .*/front/0.mp4"));
}

TEST(ImageFolderSource, NaturalOrderAndTheProfilesRate) {
  TemporaryFolder folder;
  for (const char* name : {"f10.png", "f9.bmp", "f1.png", "f2.png"}) {
    cv::imwrite((folder / name).string(), numbered_picture(std::atoi(name + 1), 64, 48));
  }
  fs::rename(folder / "f9.bmp", folder / "f9.BMP");
  cv::imwrite(folder / "background.png", numbered_picture(15, 64, 48));
  write_bytes(folder / ".hidden.png", "x");
  write_bytes(folder / "notes.txt", "x");
  fs::create_directory(folder / "sub.png");
  const Played played = play(folder.path());
  EXPECT_THAT(played.numbers, ElementsAre(1, 2, 9, 10));
  EXPECT_THAT(played.times_s, ElementsAre(0.0, 0.02, 0.16, 0.18)) << "3 to 8 are missing";
  const auto source = open_frame_source(folder.path(), small_sensor());
  EXPECT_EQ(source->frame_count().value_or(-1), 4);
  EXPECT_THAT(source->description(),
              HasSubstr("of 4 images in the order of the numbers in their names, 50 Hz, 6 numbers left out"));
  while (source->next()) {
  }
  EXPECT_EQ(source->lost_frames(), 6);
}

TEST(ImageFolderSource, NumbersWithoutACommonStepAreNoTimes) {
  TemporaryFolder folder;
  write_pictures(folder, {"3.png", "14.png", "27.png", "91.png"});
  EXPECT_THAT(play(folder.path()).times_s, ElementsAre(0.0, 0.02, 0.04, 0.06));
  write_pictures(folder, {"101.png", "111.png", "121.png", "131.png", "151.png", "161.png"});
  for (const char* name : {"3.png", "14.png", "27.png"}) fs::remove(folder / name);
  EXPECT_THAT(play(folder.path()).times_s, ElementsAre(0.0, 0.02, 0.04, 0.06, 0.08, 0.12, 0.14))
      << "every tenth frame, but for one";
}

/// As EuRoC, TUM RGB-D and others name their pictures; the last three groups have two numbers.
TEST(ImageFolderSource, NamesThatAreTimesAreTimes) {
  const std::vector<std::int64_t> some_us{1403636579763555, 1403636579813555, 1403636579913555},
      over_a_second_us{1403636579980000, 1403636580020000, 1403636580060000, 1403636580100000};
  using Names = std::vector<std::string>;
  for (const auto& [names, times_us] :
       {std::pair(Names{"1403636579763555584.png", "1403636579813555456.png", "1403636579913555456.png"},
                  some_us),
        {{"cam0_1403636579763555.png", "cam0_1403636579813555.png", "cam0_1403636579913555.png"}, some_us},
        {{"1403636579.763555.png", "1403636579.813555.png", "1403636579.913555.png"}, some_us},
        {{"1403636579_980000000.png", "1403636580_20000000.png", "1403636580_60000000.png",
          "1403636580_100000000.png"},
         over_a_second_us},
        {{"1403636579.980000000.png", "1403636580.20000000.png", "1403636580.60000000.png",
          "1403636580.100000000.png"},
         over_a_second_us},
        {{"1403636579.98.png", "1403636580.02.png", "1403636580.06.png", "1403636580.1.png"},
         over_a_second_us}}) {
    TemporaryFolder folder;
    write_pictures(folder, names);
    const auto source = open_raw_log(folder.path(), small_sensor());
    std::vector<std::int64_t> unix_us;
    while (const auto frame = source->next()) unix_us.push_back(frame->unix_us);
    EXPECT_EQ(unix_us, times_us) << names[0];
    EXPECT_THAT(source->description(),
                testing::ContainsRegex("of [34] images in the order of the .*seconds.* since 1970 in their "
                                       "names, .* Hz by these times"));
    const Played played = play(folder.path());
    for (std::size_t i = 0; i < times_us.size(); ++i)
      EXPECT_NEAR(played.times_s[i], 1e-6 * static_cast<double>(times_us[i] - times_us[0]), 1e-6) << names[i];
    EXPECT_THAT(played.warning, testing::Not(HasSubstr("time")));
  }
}

TEST(ImageFolderSource, TimesThatCannotBeRightAreSaid) {
  const auto milliseconds = [](int time) { return "1403636" + std::to_string(579000 + time) + ".png"; };
  const auto warning_of = [](const std::vector<std::string>& names) {
    TemporaryFolder folder;
    write_pictures(folder, names);
    return play(folder.path()).warning;
  };
  std::vector<std::string> back, uneven;  // by half a second, before the picture at 1 s
  for (int i = 0; i < 60; ++i) {
    back.push_back(milliseconds(40 * i - (i < 25 ? 0 : 490)));
    uneven.push_back(milliseconds(40 * i + 7 * i % 18));
  }
  EXPECT_THAT(warning_of(back),
              HasSubstr("after half of the usual time, as several before it; if the clock"));
  EXPECT_THAT(warning_of(uneven), Not(HasSubstr("clock")));
  EXPECT_THAT(warning_of({"1403636579.5.png", "1403636579.50.png", "1403636580.png"}),
              HasSubstr("1403636579.5.png: its name gives no time of its own; times are counted at 50 Hz"));
}

TEST(ImageFolderSource, NumbersThatAreNoTimesOfThisCenturyStayNumbers) {
  TemporaryFolder folder;
  write_pictures(folder, {"0000000001.png", "0000000002.png", "9999999999.png"});
  const auto source = open_frame_source(folder.path(), small_sensor());
  EXPECT_EQ(source->next()->unix_us, 0);
  EXPECT_THAT(source->description(),
              HasSubstr("of 3 images in the order of the numbers in their names, 50 Hz"));
}

/// One table for all: names in their true order (the picture shows its place in it), what they say, and the
/// times.
TEST(ImageFolderSource, NamesOfManyKinds) {
  struct Example {
    std::vector<std::string> names;
    std::string said;
    std::vector<double> times_s;
  };
  const std::vector<double> counted{0, 0.02, 0.04, 0.06};
  for (const Example& example : std::vector<Example>{
           {{"0.36", "0.4", "0.44", "0.48"}, "the seconds", {0, 0.04, 0.08, 0.12}},
           {{"9.96", "10.0", "10.04", "10.08"}, "the seconds", {0, 0.04, 0.08, 0.12}},
           {{"t0.96", "t1", "t1.04", "t1.08"}, "the seconds", {0, 0.04, 0.08, 0.12}},
           {{"v1.8", "v1.9", "v1.10", "v1.11"}, "the numbers", counted},
           {{"2024-02-28 23:59:59.960000", "2024-02-29 00:00:00", "2024-02-29 00:00:00.040000",
             "2024-02-29 00:00:00.080000"},
            "the date and time",
            {0, 0.04, 0.08, 0.12}},
           {{"cam_20240228_235959_960", "cam_20240229_000000_000", "cam_20240229_000000_040",
             "cam_20240229_000001_000"},
            "the date and time",
            {0, 0.04, 0.08, 1.04}},
           {{"2024-02-29 00:00:00+01:00", "2024-02-29 00:00:00.040000+01:00",
             "2024-02-29 00:00:00.080000+01:00", "2024-02-29 00:00:01+01:00"},
            "the date and time",
            {0, 0.04, 0.08, 1}},
           {{"0008", "0009", "000a", "000b"}, "the hexadecimal numbers", counted},
           {{"e", "f", "10", "11"}, "the hexadecimal numbers", counted},
           {{"frame_0F", "frame_10", "frame_11", "frame_12"}, "the hexadecimal numbers", counted},
           {{"frame0008", "frame0009", "frame0010", "frame0011"}, "the numbers", counted},
           {{"a1x", "a2x", "a10x", "a11x"}, "the numbers", counted},
           {{"one", "three", "two", "zero"}, "their names", counted},
           {{"0009_1403636579763", "0010_1403636579803", "0011_1403636579843", "0012_1403636579883"},
            "the milli-, micro- or nanoseconds since 1970",
            {0, 0.04, 0.08, 0.12}},
       }) {
    for (const bool with_others : {false, true}) {
      TemporaryFolder folder;
      for (std::size_t i = 0; i < 4; ++i)
        cv::imwrite((folder / (example.names[i] + ".png")).string(),
                    numbered_picture(static_cast<int>(i), 64, 48));
      const bool can_tell = with_others && example.said != "their names";
      if (can_tell) write_pictures(folder, {"thumbnail.png", "average-of-all.png", "frame.png"});
      const auto source = open_raw_log(folder.path(), small_sensor());
      EXPECT_THAT(source->description(), HasSubstr("of 4 images in the order of " + example.said));
      const Played played = play(folder.path());
      EXPECT_THAT(played.numbers, ElementsAre(0, 1, 2, 3)) << example.names[0];
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(played.times_s.at(i), example.times_s[i], 1e-6) << example.names[i];
      EXPECT_EQ(played.warning.find("3 pictures are not named like") != std::string::npos, can_tell)
          << played.warning;
    }
  }
}

TEST(ImageFolderSource, UnusableFoldersAreNamed) {
  TemporaryFolder folder;
  fs::create_symlink("../.git/annex/objects/x.png", folder / "1.png");
  EXPECT_THAT(error_of(folder.path()), HasSubstr("1.png: is a link to a file that is not there; fetch it"));
  fs::remove(folder / "1.png");
  EXPECT_THAT(error_of(folder.path()), HasSubstr("holds neither log.mkv nor gelsight.avi nor images"));
  cv::imwrite(folder / "2.png", numbered_picture(1, 65, 48));
  EXPECT_THAT(error_of(folder.path()), HasSubstr("2.png: is 65x48 pixels"));
}

TEST(ImageFolderSource, SeveralLogsInOneFolderAreRefused) {
  TemporaryFolder folder;
  write_pictures(folder, {"left_1.png", "left_2.png", "right_1.png"});
  const Played played = play(folder.path());
  EXPECT_EQ(played.numbers.size(), 2u);
  EXPECT_THAT(played.warning, HasSubstr("a picture is not named like left_1.png and left out: right_1.png"));
  write_pictures(folder, {"right_2.png"});
  EXPECT_THAT(
      error_of(folder.path()),
      HasSubstr("several series of pictures (left_1.png, right_1.png); give each a folder of its own"));
  for (const char* name : {"right_1.png", "right_2.png"}) fs::remove(folder / name);
  write_pictures(folder, {"left_2.jpg"});
  EXPECT_THAT(error_of(folder.path()), HasSubstr("in another format, too; keep one of them"));
}

TEST(EveryInput, CopiesAndStallsAreSaid) {
  TemporaryFolder folder;
  const auto write = [&](int from, int to, int number) {
    for (int i = from; i < to; ++i)
      cv::imwrite((folder / (std::to_string(i) + ".png")).string(),
                  numbered_picture((number + i) % 16, 64, 48));
  };
  write(0, 40, 0);
  EXPECT_EQ(play(folder.path()).warning, "");
  for (int i = 1; i < 40; i += 2)
    fs::copy_file(folder / (std::to_string(i - 1) + ".png"), folder / (std::to_string(i) + ".png"),
                  fs::copy_options::overwrite_existing);
  EXPECT_THAT(play(folder.path()).warning, HasSubstr("20 of 40 pictures are copies of the one before"));
  write(0, 160, 0);
  for (int i = 81; i < 135; ++i)
    fs::copy_file(folder / "80.png", folder / (std::to_string(i) + ".png"),
                  fs::copy_options::overwrite_existing);
  EXPECT_THAT(play(folder.path()).warning,
              HasSubstr("nothing new was seen for 1.1 s before " + (folder / "135.png").string() +
                        "; motion in that time is missing"));
}

}  // namespace
}  // namespace gelslam::test
