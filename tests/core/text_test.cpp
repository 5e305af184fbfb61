#include "gelslam/core/text.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

TEST(EditDistance, KnownPairs) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("flaw", "lawn"), 2);
  EXPECT_EQ(edit_distance("abc", ""), 3);
  EXPECT_EQ(edit_distance("info", "inof"), 1);
  EXPECT_EQ(edit_distance("ca", "abc"), 3) << "no byte is edited twice";
}

TEST(NearestName, FindsMisspellingsOnly) {
  const std::vector<std::string> names{"scr_threshold", "ccs_threshold", "contact_threshold"};
  EXPECT_EQ(nearest_name("src_threshold", names), "scr_threshold");
  EXPECT_EQ(nearest_name("contact_treshold", names), "contact_threshold");
  EXPECT_EQ(nearest_name("color", names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
  EXPECT_EQ(nearest_name(std::string(1000000, 'a'), names), "");
}

TEST(OneLine, HoldsNoControlCharacters) {
  EXPECT_EQ(one_line("a\nb\r\n\tc  d\x1b[31m\n"), "a b c d [31m");
  EXPECT_EQ(one_line("\n \n"), "");
  EXPECT_EQ(one_line("größe"), "größe");
}

TEST(Counted, TheNounFollowsTheNumber) {
  EXPECT_EQ(counted(0, "loop"), "0 loops");
  EXPECT_EQ(counted(1, "damaged picture"), "1 damaged picture");
  EXPECT_EQ(counted(21, "frame"), "21 frames");
  EXPECT_EQ(counted(1, "press"), "1 press");
  EXPECT_EQ(counted(2, "press"), "2 presses");
}

TEST(AppendSentence, SeparatesWhatIsNotEmpty) {
  std::string text;
  for (const char* sentence : {"", "one", "", "two"}) append_sentence(text, sentence);
  EXPECT_EQ(text, "one; two");
}

TEST(ShortNumber, KeepsTheDigitsThatMatter) {
  EXPECT_EQ(short_number(12.3456), "12.35");
  EXPECT_EQ(short_number(0.5), "0.5");
  EXPECT_EQ(short_number(12345.6), "12346");
  EXPECT_EQ(short_number(9999.7), "10000");
  EXPECT_EQ(short_number(-12345.6), "-12346");
  EXPECT_EQ(short_number(0.00002), "2e-05");
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(1.0 / 3, 2), "0.33");
  EXPECT_EQ(short_number(std::nan("")), "nan");
  EXPECT_EQ(short_number(-HUGE_VAL), "-inf");
}

TEST(DurationText, NamesItsUnit) {
  EXPECT_EQ(duration_text(0.4), "0 s");
  EXPECT_EQ(duration_text(59.4), "59 s");
  EXPECT_EQ(duration_text(59.6), "1:00 min");
  EXPECT_EQ(duration_text(125), "2:05 min");
  EXPECT_EQ(duration_text(3725), "1:02:05 h");
  EXPECT_EQ(duration_text(-1), "0 s");
  EXPECT_EQ(duration_text(HUGE_VAL), "277777:46:40 h");
}

TEST(BytesText, HasThreeDigitsAndAUnit) {
  EXPECT_EQ(bytes_text(0), "0 B");
  EXPECT_EQ(bytes_text(999), "999 B");
  EXPECT_EQ(bytes_text(1000), "1.00 kB");
  EXPECT_EQ(bytes_text(999'600), "1.00 MB");
  EXPECT_EQ(bytes_text(12'345'678), "12.3 MB");
  EXPECT_EQ(bytes_text(1'204'000'000), "1.20 GB");
  EXPECT_EQ(bytes_text(5'000'000'000'000'000), "5000 TB");
}

TEST(NaturalLess, NumbersCompareAsNumbers) {
  std::vector<std::string> names{
      "f10.png", "f9.png", "f1.png", "f01.png", "e100.png", "f.png", "f99999999999999999999999.png"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_EQ(names, (std::vector<std::string>{"e100.png", "f.png", "f01.png", "f1.png", "f9.png", "f10.png",
                                             "f99999999999999999999999.png"}));
}

TEST(NaturalLess, IsAStrictWeakOrder) {
  const std::vector<std::string> names{"",    "0",   "00",    "1",     "01",    "a", "a0",
                                       "a00", "a1b", "a01b2", "a1b02", "a1b10", "b"};
  for (const auto& a : names) {
    EXPECT_FALSE(natural_less(a, a));
    for (const auto& b : names) {
      EXPECT_EQ(natural_less(a, b) || natural_less(b, a), a != b) << a << " " << b;
      for (const auto& c : names) {
        EXPECT_TRUE(!natural_less(a, b) || !natural_less(b, c) || natural_less(a, c))
            << a << " " << b << " " << c;
      }
    }
  }
}

}  // namespace
}  // namespace gelslam
