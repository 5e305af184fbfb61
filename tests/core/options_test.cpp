#include "gelslam/core/options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

using test::message_of;
using ::testing::HasSubstr;
using ::testing::Not;

struct Options {
  double ratio = 0.3;
  int pixels = 500;
  bool robust = true;
  std::string name = "GelSight Mini";
  std::filesystem::path model;
  double deep = 1.0;
};

OptionList list(Options& options) {
  return [&options](OptionVisitor& visit) {
    visit.section("device_config", "what the sensor is", [&] {
      visit.text("device_name", options.name, "for people");
      visit.path("model", options.model, "network");
    });
    visit.section("slam_config", "", [&] {
      visit.section("track_config", "", [&] {
        visit.number("ratio", options.ratio, 0, 1, "a share");
        visit.integer("pixels", options.pixels, 1, 100000, "a count");
        visit.flag("robust", options.robust, "a switch");
      });
      visit.number("deep", options.deep, -1e300, 1e300, "any number");
    });
  };
}

Options parse(std::string_view yaml) {
  Options options;
  read_options_text(yaml, "dir/c.yaml", list(options));
  return options;
}

std::string error_in(std::string_view yaml) {
  return message_of([&] { parse(yaml); });
}

std::string track(const std::string& line) { return "slam_config:\n  track_config:\n    " + line + "\n"; }

TEST(ReadOptions, TakesGivenValuesAndKeepsDefaults) {
  const Options options = parse(
      "# a comment\ndevice_config:\n  device_name: \"DIGIT\"\nslam_config:\n  deep: -2.5e3\n  track_config:\n"
      "    pixels: 320.0\n    robust: no\n");
  EXPECT_EQ(options.name, "DIGIT");
  EXPECT_EQ(options.deep, -2500.0);
  EXPECT_EQ(options.pixels, 320);
  EXPECT_FALSE(options.robust);
  EXPECT_EQ(options.ratio, 0.3);
}

TEST(ReadOptions, WrongTypesAreNamedWithTheirLine) {
  for (const char* bad : {"abc", "0.3abc", ".nan", ".inf", "nan", "inf", "[1]", "{a: 1}", "''", "~", "0x10 ",
                          "1e999", "--1", "+-1"}) {
    EXPECT_THAT(error_in(track(std::string("ratio: ") + bad)),
                HasSubstr("c.yaml:3: slam_config.track_config.ratio must be a number"))
        << bad;
  }
  for (const char* bad : {"1.5", "abc", "[]", ".nan"}) {
    EXPECT_THAT(error_in(track(std::string("pixels: ") + bad)), HasSubstr("pixels must be a whole number"))
        << bad;
  }
  EXPECT_THAT(error_in(track("robust: 2")), HasSubstr("robust must be true or false"));
  EXPECT_THAT(error_in("device_config: {device_name: [a]}"),
              HasSubstr("device_config.device_name must be text"));
  EXPECT_THAT(error_in("\nslam_config: 3"), HasSubstr("c.yaml:2: slam_config must be a section of keys"));
  EXPECT_THAT(error_in("- 1\n- 2\n"), HasSubstr("must be a section of keys"));
  EXPECT_THAT(error_in("just words"), HasSubstr("must be a section of keys"));
}

TEST(ReadOptions, UnknownKeyNamesTheNearestOne) {
  EXPECT_THAT(error_in(track("ration: 0.2")),
              HasSubstr("c.yaml:3: slam_config.track_config.ration is an unknown key, did you mean ratio?"));
  EXPECT_THAT(error_in("slam_confg:\n  x: 1\n"),
              HasSubstr("c.yaml:1: slam_confg is an unknown key, did you mean slam_config?"));
  EXPECT_THAT(error_in("zebra: 1\n"), HasSubstr("c.yaml:1: zebra is an unknown key"));
  EXPECT_THAT(error_in("zebra: 1\n"), Not(HasSubstr("did you mean")));
  EXPECT_THAT(error_in("ratio: 1\n"), HasSubstr("belongs into slam_config.track_config"));
}

TEST(ReadOptions, HostileInputIsAnErrorOfOneLine) {
  std::string many_aliases = "a: &a [x, x, x, x, x, x, x, x, x]\n";
  for (char c = 'b'; c < 'k'; ++c) {
    const std::string previous = "*" + std::string(1, static_cast<char>(c - 1));
    many_aliases += std::string(1, c) + ": &" + c + " [" + previous;
    for (int i = 0; i < 8; ++i) many_aliases += ", " + previous;
    many_aliases += "]\n";
  }
  const std::vector<std::string> hostile{std::string(100000, '['),
                                         std::string(100000, '{'),
                                         std::string(2u << 20, 'a'),
                                         "a: [1, 2",
                                         "\"open",
                                         std::string("\0\0\0\0", 4),
                                         "a: *unknown",
                                         "? [a, b]\n: 1\n",
                                         std::string(5000, 'k') + ": 1",
                                         "key\x1b[2J: 1",
                                         "slam_config: &x {deep: *x}",
                                         "\t- x: :",
                                         "%YAML 9.9\n---\n...",
                                         "---\n---\na: 1\n",
                                         many_aliases};
  for (const std::string& yaml : hostile) {
    const std::string message = error_in(yaml);
    EXPECT_THAT(message, HasSubstr("dir/c.yaml")) << yaml.substr(0, 40);
    EXPECT_EQ(message.find_first_of("\n\r\x1b"), std::string::npos);
    EXPECT_LT(message.size(), 300u);
  }
}

TEST(ReadOptions, RelativePathsCountFromTheFileAndBackslashesOfWindowsAreUnderstoodOrNamed) {
  test::TemporaryFolder folder;
  const auto read = [&](const std::string& model) {
    test::write_bytes(folder / "c.yaml", "device_config:\n  model: " + model + "\n");
    Options options;
    read_options(folder / "c.yaml", list(options));
    return options.model;
  };
  EXPECT_EQ(read("../m/n.pth"), folder.path().parent_path() / "m/n.pth");
  EXPECT_EQ(read("/abs/n.pth"), "/abs/n.pth");
  EXPECT_EQ(read("\"\""), "");
  EXPECT_EQ(read("m\\nnmodel.pth"), folder / "m/nnmodel.pth");
  EXPECT_EQ(read("..\\m\\n.pth"), folder.path().parent_path() / "m/n.pth");
  test::write_bytes(folder / "m\\n.pth", "");  // a name on other systems
  EXPECT_EQ(read("m\\n.pth"), folder / "m\\n.pth");
  for (const char* quoted : {"\"m\\nnmodel.pth\"", "\"C:\\Users\\n.pth\"", "\"C:\\models\\n.pth\""})
    EXPECT_THAT(message_of([&] { read(quoted); }), HasSubstr("write / instead")) << quoted;
}

TEST(ReadOptions, WhatFollowsTheDocumentIsRefused) {
  for (const char* more : {"}", "]", ",", "\n---\ndevice_config: {}\n", "\n--- x"})
    EXPECT_THAT(error_in(std::string("{}") + more), HasSubstr("not valid YAML")) << more;
  EXPECT_EQ(error_in("---\n{}\n...\n"), "nothing was thrown");
}

TEST(WriteOptions, ReadsBackExactly) {
  Options written;
  written.ratio = 0.1 + 0.2;  // no short decimal
  written.pixels = 100000;
  written.robust = false;
  written.name = "quote \" back\\slash # colon: \n tab\t é \x01 end";
  written.model = "/m/with space.pth";
  written.deep = -std::numeric_limits<double>::min();
  const std::string yaml = write_options(list(written));
  const Options read = parse(yaml);
  EXPECT_EQ(read.ratio, written.ratio);
  EXPECT_EQ(read.pixels, written.pixels);
  EXPECT_EQ(read.robust, written.robust);
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.model, written.model);
  EXPECT_EQ(read.deep, written.deep);
}

TEST(WriteOptions, EveryKeyHasItsComment) {
  Options options;
  EXPECT_EQ(write_options(list(options)),
            "device_config:  # what the sensor is\n"
            "  device_name: \"GelSight Mini\"  # for people\n"
            "  model: \"\"  # network\n"
            "slam_config:\n"
            "  track_config:\n"
            "    ratio: 0.3  # a share (0 to 1)\n"
            "    pixels: 500  # a count (1 to 100000)\n"
            "    robust: true  # a switch\n"
            "  deep: 1  # any number (-1e+300 to 1e+300)\n");
}

}  // namespace
}  // namespace gelslam
