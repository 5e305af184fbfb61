#include "gelslam/core/text.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace gelslam {
namespace {

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
  EXPECT_EQ(one_line("größe 触覚 😀"), "größe 触覚 😀");
  EXPECT_EQ(one_line("a\xff"
                     "b\xc3"),
            "a?b?")
      << "no UTF-8";
  EXPECT_EQ(one_line("a\xc2\x9b"
                     "31m"),
            "a 31m")
      << "C1 controls begin sequences, too";
  EXPECT_EQ(one_line(std::string(300'000, 'x')), std::string(4000, 'x') + "...");
}

TEST(NaturalLess, NumbersCompareAsNumbers) {
  std::vector<std::string> names{
      "f10.png", "f9.png", "f1.png", "f01.png", "e100.png", "f.png", "f99999999999999999999999.png"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_EQ(names, (std::vector<std::string>{"e100.png", "f.png", "f01.png", "f1.png", "f9.png", "f10.png",
                                             "f99999999999999999999999.png"}));
}

}  // namespace
}  // namespace gelslam
