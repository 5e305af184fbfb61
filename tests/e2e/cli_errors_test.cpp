#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "../support/pictures.hpp"
#include "../support/run_program.hpp"

namespace gelslam {
namespace {

using test::ProgramResult;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::StartsWith;

ProgramResult gelslam(const std::vector<std::string>& arguments, const std::string& out = "") {
  return test::run_program(GELSLAM_PROGRAM, arguments, out);
}

/// What every mistake of a person must look like: exit code 2, nothing on stdout, one line on stderr that
/// holds `expected`.
void expect_mistake(const ProgramResult& result, const std::string& expected) {
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.error_lines(), 1) << result.err;
  EXPECT_THAT(result.err, StartsWith("gelslam: error: "));
  EXPECT_THAT(result.err, HasSubstr(expected));
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
    if (line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

TEST(Cli, EveryCommandHasAnExampleAndRefusesWhatItDoesNotKnow) {
  const std::vector<std::string> names = commands();
  ASSERT_THAT(names, testing::Contains("info"));
  for (const std::string& name : names) {
    const ProgramResult help = gelslam({name, "--help"});
    EXPECT_EQ(help.exit_code, 0) << name;
    EXPECT_THAT(help.out, HasSubstr("Example")) << name;
    EXPECT_THAT(help.out, HasSubstr("gelslam " + name)) << name << " --help shows how it is called";
    const ProgramResult unknown = gelslam({name, "--no-such-option"});
    expect_mistake(unknown, "(see gelslam " + name + " --help)");
  }
}

TEST(Cli, MisspellingsNameWhatWasMeant) {
  expect_mistake(gelslam({"inof", "x"}), "did you mean info? (see gelslam --help)");
  expect_mistake(gelslam({"info", "--jsno", "x"}), "did you mean --json? (see gelslam info --help)");
}

TEST(Cli, AFullStandardOutputIsNoticed) {
  const ProgramResult result = gelslam({"--help"}, "/dev/full");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.error_lines(), 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("cannot write to standard output"));
}

TEST(InfoErrors, EveryUnusableInputIsOneLine) {
  const TemporaryFolder folder;
  test::write_bytes(folder / "text.avi", "no video\n");
  test::write_bytes(folder / "empty.avi", "");
  test::write_bytes(folder / "noise.avi", std::string("\0\1\2\3", 4) + std::string(3000, '\xa7'));
  std::filesystem::create_directory(folder / "empty");
  expect_mistake(gelslam({"info"}), "PATH is required");
  expect_mistake(gelslam({"info", (folder / "none").string()}), "none: no such file or folder");
  expect_mistake(gelslam({"info", (folder / "two\nlines").string()}), "two lines: no such file or folder");
  expect_mistake(gelslam({"info", (folder / "text.avi").string()}), "text.avi: not a video");
  expect_mistake(gelslam({"info", (folder / "empty.avi").string()}), "empty.avi: the file is empty");
  expect_mistake(gelslam({"info", (folder / "noise.avi").string()}), "noise.avi: not a video");
  expect_mistake(gelslam({"info", (folder / "empty").string()}), "the folder holds neither");
}

}  // namespace
}  // namespace gelslam
