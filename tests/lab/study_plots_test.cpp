#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/run_program.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::Not;

const std::string kPython = "/usr/bin/python3";

bool can_draw() {
  static const bool can = run_program(kPython, {"-c", "import matplotlib"}).exit_code == 0;
  return can;
}

TEST(StudyPlots, WithoutAStudyTheySayWhatWritesIt) {
  if (!can_draw()) GTEST_SKIP() << "no matplotlib";
  const TemporaryFolder folder;
  std::vector<std::string> arguments = {"-c", R"(import runpy, sys
scripts, study = sys.argv[1], sys.argv[2]
sys.path.insert(0, scripts)
for name in sys.argv[3:]:
    sys.argv = [f"{scripts}/plot_{name}.py", study]
    try:
        runpy.run_path(sys.argv[0], run_name="__main__")
    except SystemExit as end:
        print(f"plot_{name} ends with:", end.code, file=sys.stderr)
)",
                                        GELSLAM_SCRIPTS, folder.path().string()};
  const std::vector<std::string> names = {"stability", "speed_accuracy", "long_scan", "benchmark",
                                          "ablation"};
  arguments.insert(arguments.end(), names.begin(), names.end());
  const ProgramResult result =
      run_program(kPython, arguments);  // one process: matplotlib takes a second to load
  EXPECT_EQ(result.exit_code, 0);
  for (const std::string& name : names)
    EXPECT_THAT(result.err, testing::ContainsRegex("plot_" + name + " ends with: [^\n]*plot_" + name +
                                                   ": [^\n]*write it with"));
  EXPECT_THAT(result.err, Not(HasSubstr("Traceback")));
}

TEST(StudyPrograms, MistakesAreOneLine) {
  expect_mistake(run_program(GELSLAM_LAB, {"stability", "--methods", "icq"}), "did you mean icp?",
                 "gelslam-lab");
}

}  // namespace
}  // namespace gelslam
