#include "ui/script.hpp"

#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <random>
#include <set>
#include <sstream>

#include "fake_session.hpp"
#include "gelslam/core/error.hpp"
#include "live/live_controls.hpp"
#include "temporary_folder.hpp"

namespace gelslam::viewer::detail {
namespace {

std::string complaint(const std::string& text) {
  return test::message_of<Error>([&text] { parse_script(text, "demo.txt"); });
}

TEST(Script, ReadsEveryCommand) {
  const auto commands = parse_script(
      "# a scan\n"
      "wait 0.5; until tracking 20\n"
      "\n"
      "key Space\n"
      "click Stop and save   # the button\n"
      "move 10 20\n"
      "drag -100 50 right\n"
      "scroll -3\n"
      "screenshot a picture.png\n"
      "resize 640 480\n"
      "until finished\n"
      "quit\n",
      "demo.txt");
  ASSERT_EQ(commands.size(), 11U);
  EXPECT_EQ(commands[0].x, 0.5);
  EXPECT_EQ(commands[1].text, "tracking");
  EXPECT_EQ(commands[1].x, 20);
  EXPECT_EQ(commands[1].line, 2);
  EXPECT_EQ(commands[2].code, GLFW_KEY_SPACE);
  EXPECT_EQ(commands[3].text, "Stop and save");
  EXPECT_EQ(commands[5].code, GLFW_MOUSE_BUTTON_RIGHT);
  EXPECT_EQ(commands[5].x, -100);
  EXPECT_EQ(commands[6].y, -3);
  EXPECT_EQ(commands[7].text, "a picture.png");
  EXPECT_EQ(commands[8].y, 480);
  EXPECT_EQ(commands[9].x, 60) << "patience when none is given";
  EXPECT_EQ(commands[10].line, 12);
  EXPECT_TRUE(parse_script("", "x").empty());
}

TEST(Script, NamesLineAndWordOfAMistake) {
  EXPECT_EQ(complaint("wait 1\nscrol 3"), "demo.txt, line 2: 'scrol' is no command; did you mean 'scroll'?");
  EXPECT_EQ(complaint("until trackin"), "demo.txt, line 1: 'trackin' is no state; did you mean 'tracking'?");
  EXPECT_EQ(complaint("key spce"), "demo.txt, line 1: 'spce' is no key; did you mean 'space'?");
  EXPECT_EQ(complaint("wait"), "demo.txt, line 1: 'wait' wants a time in seconds after it");
  EXPECT_EQ(complaint("wait soon"), "demo.txt, line 1: 'soon' is not a time in seconds between 0 and 86400");
  EXPECT_EQ(complaint("\n\nquit now"), "demo.txt, line 3: 'now' is one word too many after 'quit'");
  EXPECT_EQ(complaint("screenshot a.jpg"), "demo.txt, line 1: 'a.jpg' does not end in .png");
  for (const char* bad : {"wait -1", "wait nan", "wait 1e9", "wait 0x10", "resize 0 5", "resize 100 99999",
                          "resize 640", "drag 1", "drag 1 2 thumb", "scroll inf", "until", "click", "key"})
    EXPECT_TRUE(complaint(bad).starts_with("demo.txt, line 1: ")) << bad;
}

TEST(Script, TakesHostileTextWithoutHarm) {
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    std::string text = "wait 1\nkey space\nuntil lost 3\n";
    for (int j = 0; j < 12; ++j) text[random() % text.size()] = static_cast<char>(random());
    try {
      parse_script(text, "x");
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_THROW(parse_script(std::string(2 << 20, ' '), "x"), Error);
}

TEST(Keys, HaveOneMeaningEachAndAName) {
  test::FakeSession session(1);
  const LiveControls controls(session);
  std::set<int> codes;
  for (const ActionRow& row : controls.rows()) {
    std::istringstream names(row.keys);
    for (std::string name; names >> name;) {
      ASSERT_TRUE(key_of_name(name)) << name;
      EXPECT_TRUE(codes.insert(*key_of_name(name)).second) << name;
    }
    if (row.keys.empty()) continue;  // a button for several keys
    EXPECT_TRUE(codes.contains(key_of_name(row.key).value_or(-1)))
        << "the help says what a script can press: " << row.key;
  }
  EXPECT_FALSE(codes.contains(GLFW_KEY_F12));
}

}  // namespace
}  // namespace gelslam::viewer::detail
