#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "../support/data_folder.hpp"
#include "../support/pictures.hpp"
#include "../support/run_program.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using test::expect_mistake;
using test::ProgramResult;
using test::TemporaryFolder;
using ::testing::HasSubstr;

ProgramResult gelslam(const std::vector<std::string>& arguments, const std::string& out = "") {
  return test::run_program(GELSLAM_PROGRAM, arguments, out);
}

TEST(Cli, WithoutCommandItPrintsHelp) {
  const ProgramResult result = gelslam({});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("Usage: gelslam"));
  EXPECT_EQ(result.err, "");
}

TEST(Cli, VersionAndHelpGoToStdout) {
  EXPECT_THAT(gelslam({"--version"}).out, testing::MatchesRegex("gelslam [0-9.]+\n"));
  EXPECT_EQ(gelslam({"--version"}).exit_code, 0);
  EXPECT_EQ(gelslam({"--help"}).exit_code, 0);
}

/// The names of the commands, read from the help itself.
std::vector<std::string> commands() {
  const std::string help = gelslam({"--help"}).out;
  std::istringstream lines(help.substr(help.find("Subcommands:")));
  std::vector<std::string> names;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line) && line.starts_with("  ")) {
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    if (!name.empty() && name != "benchmark") names.push_back(name);  // that one is gelslam-lab's
  }
  return names;
}

/// What `gelslam COMMAND --help` prints; each is run once.
const std::string& help_of(std::vector<std::string> command) {
  static std::map<std::vector<std::string>, std::string> known;
  const auto [place, is_new] = known.try_emplace(command);
  if (!is_new) return place->second;
  command.emplace_back("--help");
  const ProgramResult help = gelslam(command);
  EXPECT_EQ(help.exit_code, 0) << command.front();
  return place->second = help.out;
}

TEST(Cli, EveryCommandHasAnExampleAndRefusesWhatItDoesNotKnow) {
  const std::vector<std::string> names = commands();
  ASSERT_THAT(names, testing::Contains("info"));
  for (const std::string& name : names) {
    const std::string help = help_of({name});
    EXPECT_THAT(help, HasSubstr("Example")) << name;
    EXPECT_THAT(help, HasSubstr("gelslam " + name)) << name << " --help shows how it is called";
    const ProgramResult unknown = gelslam({name, "--no-such-option"});
    expect_mistake(unknown, "(see gelslam " + name + " --help)");
  }
}

TEST(Cli, HelpReadsAlikeInAllCommands) {
  std::vector<std::vector<std::string>> lines;
  for (const std::string& name : commands()) lines.push_back({name});
  for (const char* name : {"collect", "train", "check"}) lines.push_back({"calibrate", name});
  for (const char* name : {"scan", "presses"}) lines.push_back({"simulate", name});
  for (const std::vector<std::string>& line : lines) {
    const bool has_subcommands = help_of(line).find("Subcommands:") != std::string::npos;
    EXPECT_EQ(help_of(line).find("-q,--quiet") == std::string::npos, has_subcommands) << line.front();
    std::istringstream help(help_of(line));
    // An option's text stands beside it, or alone in its column on the next line.
    for (std::string text; std::getline(help, text);) {
      if (!text.starts_with("  -")) continue;
      const std::size_t gap = text.find("  ", 4);
      if (gap == std::string::npos) continue;
      const std::size_t begin = text.find_first_not_of(' ', gap);
      if (begin == std::string::npos) continue;
      EXPECT_FALSE(std::islower(static_cast<unsigned char>(text[begin]))) << line.front() << ": " << text;
      if (text.find("--quiet") != std::string::npos) {
        EXPECT_THAT(text, HasSubstr("Print no progress and no summary, only results"));
      }
    }
  }
}

TEST(Cli, MisspellingsNameWhatWasMeant) {
  expect_mistake(gelslam({"inof", "x"}), "there is no gelslam inof, did you mean info? (see gelslam --help)");
  expect_mistake(gelslam({"merge", "a", "b", "-o", "c"}), "there is no gelslam merge (see gelslam --help)");
  expect_mistake(
      gelslam({"calibrate", "colect", "-o", "x"}),
      "there is no gelslam calibrate colect, did you mean collect? (see gelslam calibrate --help)");
  expect_mistake(gelslam({"info", "--jsno", "x"}), "did you mean --json? (see gelslam info --help)");
}

TEST(Cli, NumbersAreReadWholeOrRefused) {
  const auto diameter = [](const char* text) {
    return gelslam({"calibrate", "collect", "x.mkv", "-o", "x", "--diameter", text, "--headless"});
  };
  expect_mistake(diameter("6,35"),
                 "--diameter: 6,35 is no number from 0.5 to 100 (write a point, not a comma)");
  expect_mistake(diameter("6.35mm"), "--diameter: 6.35mm is no number from 0.5 to 100 (see");
  for (const char* text : {"", "nan", "inf", "0.4", "100.1", "-6.35", "0x10"})
    expect_mistake(diameter(text), "0.5 to 100");
  expect_mistake(diameter("6.35"), "x.mkv");  // the number is right, and what comes next is wrong
}

TEST(Cli, DotsOfASimulatedGelNeedNoNumber) {
  const TemporaryFolder folder;
  const auto background = [&](const std::string& name, std::vector<std::string> dots) {
    dots.insert(dots.begin(), {"simulate", "scan", "--object", "sphere", "--frames", "1", "-q"});
    dots.insert(dots.end(), {"-o", (folder / name).string()});
    const ProgramResult result = gelslam(dots);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    cv::Mat first;
    cv::VideoCapture((folder / name / "gelsight.avi").string()).read(first);
    return first;
  };
  const cv::Mat3b dotted = background("dotted", {"--dots"});
  EXPECT_EQ(cv::norm(dotted, background("two", {"--dots", "2"})), 0.0);
  EXPECT_LT(dotted(120, 160)[1], dotted(120, 176)[1] / 2) << "a dot in the middle, none beside it";
  expect_mistake(gelslam({"simulate", "scan", "--dots", "0.2", "-o", (folder / "none").string()}),
                 "the distance of printed dots must be between 0.5 and 10 mm");
}

TEST(Cli, AFullStandardOutputIsNoticed) {
  const ProgramResult result = gelslam({"--help"}, "/dev/full");
  expect_mistake(result, "cannot write to standard output");
  const TemporaryFolder folder;
  test::write_bytes(folder / "trajectory.tum", "0 0 0 0 0 0 0 1\n");
  expect_mistake(gelslam({"info", "--json", (folder / "trajectory.tum").string()}, "/dev/full"),
                 "cannot write to standard output");
}

TEST(Cli, NoOptionReplacesARecording) {
  const TemporaryFolder folder;
  const std::string video = (folder / "gelsight.avi").string(), log = (folder / "log.mkv").string();
  for (const std::string& file : {video, log, (folder / "catalog.csv").string()})
    test::write_bytes(file, "\x1A\x45\xDF\xA3 pictures");
  for (const char* what : {"scan", "presses"})
    expect_mistake(gelslam({"simulate", what, "-o", folder.path().string(), "--overwrite"}),
                   "and so was not made by this command");
  std::filesystem::remove(folder / "catalog.csv");
  test::write_bytes(folder / "meta.json", "{}");
  expect_mistake(gelslam({"simulate", "scan", "-o", folder.path().string(), "--overwrite"}),
                 "for it holds the recording log.mkv");
  for (const char* command : {"export", "view"}) {
    std::vector<std::string> words{command, "m.ply", command == std::string("view") ? "--snapshot" : "-o",
                                   log};
    if (command == std::string("export")) words.back() += ".glb";
    if (command == std::string("view")) words.back() += ".png";
    test::write_bytes(words.back(), "\x1A\x45\xDF\xA3 pictures");
    words.emplace_back("--overwrite");
    expect_mistake(gelslam(words), "is a recording, which cannot be made again");
  }
  expect_mistake(gelslam({"calibrate", "train", folder.path().string(), "-o", log, "--overwrite"}),
                 "is a recording, which cannot be made again");
}

/// One rule for whatever is written: what is there stays, unless --overwrite is given.
TEST(Cli, NoOutputReplacesWhatIsThereUnasked) {
  const TemporaryFolder folder;
  for (const char* file : {"config.yaml", "a.json", "a.png", "session.db"})
    test::write_bytes(folder / file, "precious");
  const std::string run = folder.path().string(), json = run + "/a.json", png = run + "/a.png";
  for (const char* what : {"scan", "presses"})
    expect_mistake(gelslam({"simulate", what, "-o", run}), "exists already");
  const auto trained = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"calibrate", "train", "no presses", "-o"});
    return gelslam(more);
  };
  expect_mistake(trained({json}), "is already there; choose another name, or give --overwrite");
  expect_mistake(trained({json, "--overwrite"}), "no presses");
  expect_mistake(trained({run + "/session.db", "--overwrite"}), "is a recording");
  expect_mistake(trained({run}), "is a folder");
  expect_mistake(gelslam({"view", "m.ply", "--snapshot", png}), "is already there");
  for (const char* file : {"config.yaml", "a.json", "a.png", "session.db"})
    EXPECT_EQ(test::read_bytes(folder / file), "precious");
}

TEST(InfoErrors, EveryUnusableInputIsOneLine) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "text.avi", "no video\n");
  test::write_bytes(folder / "text.pt", "no model\n");
  test::write_bytes(folder / "empty.avi", "");
  test::write_bytes(folder / "noise.avi", std::string("\0\1\2\3", 4) + std::string(3000, '\xa7'));
  std::filesystem::create_directory(folder / "empty");
  expect_mistake(gelslam({"info"}), "PATH is required");
  expect_mistake(gelslam({"info", (folder / "none").string()}), "none: no such file or folder");
  expect_mistake(gelslam({"info", (folder / "two\nlines").string()}), "two lines: no such file or folder");
  expect_mistake(gelslam({"info", (folder / "text.avi").string()}), "text.avi: not a video");
  expect_mistake(gelslam({"info", (folder / "text.pt").string()}),
                 "neither an nnmodel.pth or nnmini.pt (zip");
  expect_mistake(gelslam({"info", (folder / "empty.avi").string()}), "empty.avi: the file is empty");
  expect_mistake(gelslam({"info", (folder / "noise.avi").string()}), "noise.avi: not a video");
  expect_mistake(gelslam({"info", (folder / "empty").string()}), "the folder holds neither");
}

fs::path real_model() { return test::data_folder() / "calibration/model/nnmodel.pth"; }

/// Mistakes in what `gelslam reconstruct` is given; whichever it is, no output may be left behind.
class ReconstructErrors : public testing::Test {
 protected:
  ProgramResult reconstruct(const std::string& log, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"reconstruct", (folder / log).string(), "-o",
                                       (folder / "out/RUN").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = gelslam(arguments);
    EXPECT_FALSE(fs::exists(folder / "out"));
    return result;
  }

  TemporaryFolder folder;
};

TEST_F(ReconstructErrors, LogsAndConfigurationsThatCannotBeUsed) {
  test::write_video(folder / "log.avi", "MJPG", 3, 320, 240);
  test::write_bytes(folder / "text.avi", "no video\n");
  test::write_bytes(folder / "text.pt", "no model\n");
  test::write_bytes(folder / "model.pth", "no model");
  test::write_bytes(folder / "typo.yaml", "gelslam_config:\n  track_config:\n    scr_treshold: 0.3\n");
  test::write_bytes(folder / "range.yaml", "gelslam_config:\n  track_config:\n    scr_threshold: 3\n");
  test::write_bytes(folder / "broken.yaml", "device_config: [\n");
  const std::string model = (folder / "model.pth").string();
  expect_mistake(gelslam({"reconstruct"}), "(see gelslam reconstruct --help)");
  expect_mistake(gelslam({"reconstruct", (folder / "log.avi").string()}), "--output is required");
  expect_mistake(reconstruct("none.avi", {"--model", model}), "none.avi: no such file or folder");
  if (fs::exists(real_model()))
    expect_mistake(reconstruct("text.avi", {"--model", real_model().string()}), "text.avi: not a video");
  expect_mistake(reconstruct(std::string(300, 'a'), {"--model", model}), "name too long");
  expect_mistake(reconstruct("log.avi", {}), "no gradient model");
  expect_mistake(reconstruct("log.avi", {"--model", (folder / "none.pth").string()}), "none.pth");
  expect_mistake(reconstruct("log.avi", {"--model", model}), "model.pth");
  expect_mistake(reconstruct("log.avi", {"--config", (folder / "none.yaml").string()}),
                 "none.yaml: no such file");
  expect_mistake(
      reconstruct("log.avi", {"--config", (folder / "typo.yaml").string()}),
      "typo.yaml:3: gelslam_config.track_config.scr_treshold is an unknown key, did you mean scr_threshold?");
  expect_mistake(reconstruct("log.avi", {"--config", (folder / "range.yaml").string()}), "range.yaml:3: ");
  expect_mistake(reconstruct("log.avi", {"--config", (folder / "broken.yaml").string()}), "broken.yaml:");
}

TEST_F(ReconstructErrors, PicturesThatCannotBeUsed) {
  if (!fs::exists(real_model())) GTEST_SKIP() << "no model at " << real_model() << "; set GELSLAM_DATA";
  const std::vector<std::string> model{"--model", real_model().string()};
  test::write_video(folder / "gray.avi", "MJPG", 12, 320, 240, 25.0, /*gray=*/true);
  test::write_video(folder / "small.avi", "MJPG", 12, 160, 120);
  test::write_video(folder / "short.avi", "MJPG", 3, 320, 240);
  fs::create_directory(folder / "images");
  for (int i = 0; i < 12; ++i) {
    cv::imwrite((folder / ("images/" + std::to_string(i) + ".png")).string(),
                cv::Mat1b(240, 320, static_cast<uchar>(i)));
  }
  expect_mistake(reconstruct("gray.avi", model), "gray.avi, frame 0: a gray picture");
  expect_mistake(reconstruct("small.avi", model), "small.avi, frame 0: is 160x120 pixels");
  expect_mistake(reconstruct("short.avi", model), "3");
  expect_mistake(reconstruct("images", model), "0.png: a gray picture");
  expect_mistake(reconstruct("images/0.png", model), "a single image");
}

TEST_F(ReconstructErrors, OutputsThatMayNotBeReplaced) {
  if (!fs::exists(real_model())) GTEST_SKIP() << "no model at " << real_model() << "; set GELSLAM_DATA";
  test::write_video(folder / "log.avi", "MJPG", 12, 320, 240);
  fs::create_directory(folder / "full");
  test::write_bytes(folder / "full/precious.txt", "1");
  test::write_bytes(folder / "file", "1");
  const auto run = [&](const fs::path& output, bool overwrite) {
    std::vector<std::string> arguments{"reconstruct", (folder / "log.avi").string(),
                                       "--model",     real_model().string(),
                                       "-o",          output.string()};
    if (overwrite) arguments.push_back("--overwrite");
    return gelslam(arguments);
  };
  expect_mistake(run(folder / "full", false), "full: exists already");
  expect_mistake(run(folder / "full", true), "full: will not be overwritten");
  expect_mistake(run(folder / "file", true), "file: is a file");
  expect_mistake(run(folder / "file/RUN", false), "cannot be created");
  EXPECT_EQ(test::read_bytes(folder / "full/precious.txt"), "1");
  EXPECT_THAT(folder.names(), testing::ElementsAre("file", "full", "log.avi"));
}

}  // namespace
}  // namespace gelslam
