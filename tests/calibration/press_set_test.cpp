#include "gelslam/calibration/press_set.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "../support/peak_memory.hpp"
#include "../support/pictures.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/zip_archive.hpp"
#include "simulated_presses.hpp"

namespace gelslam::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Two presses with pictures of any content: reading does not look at it.
PressSet small_set() {
  PressSet set;
  set.background = numbered_picture(0, 64, 48);
  set.presses.push_back({"6mm/0", 6.31, numbered_picture(1, 64, 48), ContactCircle{30.25, 20.5, 11.0}});
  set.presses.push_back({"9mm/0", 9.5, numbered_picture(2, 64, 48), std::nullopt});
  return set;
}

std::string refusal(const fs::path& folder) {
  return message_of([&] { read_press_set(folder); });
}

TEST(PressSet, ComesBackAsItWasWritten) {
  const TemporaryFolder folder;
  const PressSet written = small_set();
  write_folder(folder.path(), written);
  const PressSet read = read_press_set(folder.path());
  ASSERT_EQ(read.presses.size(), 2U);
  EXPECT_EQ(read.presses[0].name, "6mm/0");
  EXPECT_EQ(read.presses[1].diameter_mm, 9.5);
  EXPECT_EQ(cv::norm(read.presses[1].bgr, written.presses[1].bgr), 0.0);
  EXPECT_EQ(cv::norm(read.background, written.background), 0.0);
  ASSERT_TRUE(read.presses[0].label);
  EXPECT_EQ(read.presses[0].label->u_px, 30.25);
  EXPECT_EQ(read.presses[0].label->v_px, 20.5);
  EXPECT_EQ(read.presses[0].label->radius_px, 11.0);
  EXPECT_FALSE(read.presses[1].label);
}

TEST(PressSet, ACatalogOfAnySizeTakesNoMemory) {
  const TemporaryFolder folder;
  write_folder(folder.path(), small_set());
  fs::resize_file(folder / "catalog.csv", std::uintmax_t{1} << 28);  // one line of zeros
  std::string reason;
  const std::size_t bytes = memory_growth([&] { reason = refusal(folder.path()); });
  EXPECT_THAT(reason, HasSubstr("is too large for a catalog"));
  EXPECT_LT(bytes, std::size_t{1} << 26);
}

TEST(PressSet, ABadPressDoesNotStopTheOthers) {
  const TemporaryFolder folder;
  const auto problem = [&] {
    const PressSet read = read_press_set(folder.path());
    EXPECT_EQ(read.presses[0].problem, "");
    EXPECT_EQ(read.presses[1].bgr.size(), read.background.size());
    return read.presses[1].problem;
  };
  write_folder(folder.path(), small_set());
  EXPECT_EQ(problem(), "");
  const fs::path picture = folder / "9mm/0/gelsight.png";
  write_bytes(picture, read_bytes(picture).substr(0, 100));
  EXPECT_THAT(problem(), HasSubstr("9mm/0/gelsight.png"));
  cv::imwrite(picture.string(), numbered_picture(2, 60, 48));
  EXPECT_THAT(problem(), HasSubstr("is 60x48 but the background is 64x48"));
  cv::imwrite(picture.string(), cv::Mat3b(48, 64, cv::Vec3b(0, 0, 0)));
  EXPECT_THAT(problem(), HasSubstr("a gray picture"));
  cv::imwrite(picture.string(), cv::Mat3b(48, 64, cv::Vec3b(0, 160, 0)));
  EXPECT_THAT(problem(), HasSubstr("one color all over"));
  fs::remove(picture);
  EXPECT_THAT(problem(), HasSubstr("9mm/0/gelsight.png"));
  cv::imwrite(picture.string(), numbered_picture(2, 64, 48));
  write_bytes(folder / "9mm/0/label.npz", "no archive");
  EXPECT_THAT(problem(), HasSubstr("9mm/0/label.npz"));
  EXPECT_FALSE(read_press_set(folder.path()).presses[1].label);
}

TEST(PressSet, ReadsTheCatalogOfWindows) {
  const TemporaryFolder folder;
  write_folder(folder.path(), small_set());
  write_bytes(folder / "catalog.csv", "experiment_reldir,diameter(mm)\r\n6mm\\0,6.31\r\n9mm\\0,9.5\r\n");
  const PressSet set = read_press_set(folder.path());
  EXPECT_EQ(set.presses[1].name, "9mm/0");
  EXPECT_EQ(set.presses[1].problem, "");
}

TEST(PressSet, ReadsACatalogWithDecimalCommas) {
  const TemporaryFolder folder;
  write_folder(folder.path(), small_set());
  fs::rename(folder / "6mm", folder / "6,31mm");
  write_bytes(folder / "catalog.csv", "experiment_reldir;diameter(mm)\n6,31mm/0;6,31\n9mm/0;9,5\n");
  const PressSet read = read_press_set(folder.path());
  EXPECT_EQ(read.presses.at(0).diameter_mm, 6.31);
  EXPECT_EQ(read.presses.at(1).diameter_mm, 9.5);
  EXPECT_EQ(read.presses[0].name, "6,31mm/0");
  EXPECT_EQ(read.presses[1].name, "9mm/0");
}

TEST(PressSet, SaysWhichLineOfTheCatalogIsWrong) {
  const TemporaryFolder folder;
  write_folder(folder.path(), small_set());
  const auto with = [&](const std::string& line) {
    write_bytes(folder / "catalog.csv", "h\n6mm/0,6.31\n" + line + "\n");
    return refusal(folder.path());
  };
  EXPECT_THAT(with("9mm/0"), HasSubstr("line 3 cannot be read"));
  EXPECT_THAT(with("9mm/0,big"), HasSubstr("line 3 cannot be read"));
  EXPECT_THAT(with("9mm/0,nan"), HasSubstr("the diameter must be"));
  EXPECT_THAT(with("9mm/0,-9.5"), HasSubstr("the diameter must be"));
  EXPECT_THAT(with("../secret,9.5"), HasSubstr("must lie inside"));
  EXPECT_THAT(with("..\\secret,9.5"), HasSubstr("must lie inside"));
  EXPECT_THAT(with("/etc,9.5"), HasSubstr("must lie inside"));
  EXPECT_THAT(with("6mm/0,9.5"), HasSubstr("is there twice"));
  EXPECT_THAT(with(std::string(5000, 'x') + ",9.5"), HasSubstr("too long"));
  write_bytes(folder / "catalog.csv", "header\n");
  EXPECT_THAT(refusal(folder.path()), HasSubstr("names no presses"));
  write_bytes(folder / "catalog.csv", "6mm/0,6.31\n9mm/0,9.5\n");  // its first press would go unseen
  EXPECT_THAT(refusal(folder.path()), HasSubstr("has no header"));
}

TEST(Label, RefusesWhatIsNoCircle) {
  const TemporaryFolder folder;
  const fs::path path = folder / "label.npz";
  const auto refused = [&] { return message_of([&] { read_label(path); }); };
  const auto save = [&](std::vector<double> center, std::vector<double> radius) {
    write_zip(path, {{"center.npy", format_npy({center.size()}, center)},
                     {"radius.npy", format_npy({radius.size()}, radius)}});
  };
  save({1, 2, 3}, {4});
  EXPECT_THAT(refused(), HasSubstr("holds 3 numbers, expected 2"));
  save({1, 2}, {-4});
  EXPECT_THAT(refused(), HasSubstr("no circle"));
  save({std::nan(""), 2}, {4});
  EXPECT_THAT(refused(), HasSubstr("no circle"));
  save({1, 2}, {std::numeric_limits<double>::infinity()});
  EXPECT_THAT(refused(), HasSubstr("no circle"));
  write_zip(path, {{"center.npy", "nonsense"}, {"radius.npy", ""}});
  EXPECT_THAT(refused(), HasSubstr("not a usable .npy"));
  write_zip(path, {{"radius.npy", ""}});
  EXPECT_THAT(refused(), HasSubstr("'center.npy' is missing"));
  write_zip(path, {{"center.npy", std::string(100'000, 'x')}});
  EXPECT_THAT(refused(), HasSubstr("more than expected"));
  write_bytes(path, "no archive");
  EXPECT_THAT(refused(), HasSubstr("no zip archive"));
}

}  // namespace
}  // namespace gelslam::test
