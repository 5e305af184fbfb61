#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "../support/pictures.hpp"
#include "../support/run_program.hpp"

namespace gelslam {
namespace {

using namespace test;
using ::testing::HasSubstr;

TEST(Cli, VersionAndHelpGoToStdout) {
  EXPECT_THAT(gelslam({"--version"}).out, testing::MatchesRegex("gelslam [0-9.]+\n"));
  EXPECT_EQ(gelslam({"--version"}).exit_code, 0);
  EXPECT_EQ(gelslam({"--help"}).exit_code, 0);
}

/// The names of the commands, read from the help itself.
std::vector<std::string> commands() {
  const std::string help = gelslam({"--help"}).out;
  std::vector<std::string> names;
  for (const std::string& line : lines_of(help.substr(help.find("Subcommands:")))) {
    if (!line.starts_with("  ")) continue;
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    if (!name.empty()) names.push_back(name);
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

TEST(Cli, MisspellingsNameWhatWasMeant) {
  expect_mistake(gelslam({"inof", "x"}), "there is no gelslam inof, did you mean info? (see gelslam --help)");
  expect_mistake(gelslam({"merge", "a", "b", "-o", "c"}), "there is no gelslam merge (see gelslam --help)");
  expect_mistake(gelslam({"replay", "--help"}), "there is no gelslam replay (see gelslam --help)");
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
  for (const char* text : {"-1", "18446744073709551616", "1e3", "1.5", "0x10", ""})
    expect_mistake(gelslam({"simulate", "scan", "--seed", text}), " is no whole number from 0 to");
  expect_mistake(gelslam({"map", "x.ply", "-o", "x", "--touches", "08", "--units", "mm"}),
                 "x.ply");  // not octal
  expect_mistake(gelslam({"simulate", "scan", "--frames", "200001"}),
                 "200001 is no whole number from 1 to 200000");
}

TEST(Cli, AFullStandardOutputIsNoticed) {
  const ProgramResult result = gelslam({"--help"}, "/dev/full");
  expect_mistake(result, "cannot write to standard output");
  const TemporaryFolder folder;
  write_bytes(folder / "trajectory.tum", "0 0 0 0 0 0 0 1\n");
  expect_mistake(gelslam({"info", "--json", (folder / "trajectory.tum").string()}, "/dev/full"),
                 "cannot write to standard output");
}

TEST(Cli, NoOptionReplacesARecording) {
  const TemporaryFolder folder;
  const std::string video = (folder / "gelsight.avi").string(), log = (folder / "log.mkv").string();
  for (const std::string& file : {video, log, (folder / "catalog.csv").string()})
    write_bytes(file, "\x1A\x45\xDF\xA3 pictures");
  for (const char* what : {"scan", "presses"})
    expect_mistake(gelslam({"simulate", what, "-o", folder.path().string(), "--overwrite"}),
                   "and so was not made by this command");
  std::filesystem::remove(folder / "catalog.csv");
  write_bytes(folder / "meta.json", "{}");
  expect_mistake(gelslam({"simulate", "scan", "-o", folder.path().string(), "--overwrite"}),
                 "for it holds the recording log.mkv");
  std::filesystem::remove(log);
  expect_mistake(gelslam({"simulate", "scan", "-o", folder.path().string(), "--overwrite"}),
                 "for its meta.json is not of this command");
  EXPECT_TRUE(std::filesystem::exists(video));
  write_bytes(log, "\x1A\x45\xDF\xA3 pictures");
  for (const auto& [command, option, ending] :
       {std::array{"export", "-o", ".glb"}, std::array{"view", "--snapshot", ".png"}}) {
    write_bytes(log + ending, "\x1A\x45\xDF\xA3 pictures");
    expect_mistake(gelslam({command, "m.ply", option, log + ending, "--overwrite"}),
                   "is a recording, which cannot be made again");
  }
  expect_mistake(gelslam({"calibrate", "train", folder.path().string(), "-o", log, "--overwrite"}),
                 "is a recording, which cannot be made again");
}

/// One rule for whatever is written: what is there stays, unless --overwrite is given.
TEST(Cli, NoOutputReplacesWhatIsThereUnasked) {
  const TemporaryFolder folder;
  for (const char* file : {"config.yaml", "a.json", "a.png", "session.db"})
    write_bytes(folder / file, "precious");
  const std::string run = folder.path().string(), json = run + "/a.json", png = run + "/a.png";
  for (const char* what : {"scan", "presses"})
    expect_mistake(gelslam({"simulate", what, "-o", run}),
                   "exists already; name another folder or give --overwrite");
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
    EXPECT_EQ(read_bytes(folder / file), "precious");
}

TEST(Cli, WhatReconstructCannotUseIsOneLineAndNothingIsLeft) {
  const TemporaryFolder folder;
  write_video(folder / "log.avi", "MJPG", 3, 320, 240);
  write_bytes(folder / "typo.yaml", "gelslam_config:\n  track_config:\n    scr_treshold: 0.3\n");
  const auto reconstruct = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"reconstruct", folder / "log.avi", "-o", folder / "out/RUN"});
    return gelslam(more);
  };
  expect_mistake(gelslam({"reconstruct", folder / "log.avi"}), "--output is required");
  expect_mistake(reconstruct({}), "no gradient model");
  expect_mistake(reconstruct({"--model", folder / "none.pth"}), "none.pth");
  expect_mistake(
      reconstruct({"--config", folder / "typo.yaml"}),
      "typo.yaml:3: gelslam_config.track_config.scr_treshold is an unknown key, did you mean scr_threshold?");
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace gelslam
