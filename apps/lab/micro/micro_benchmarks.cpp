// Runs the micro-benchmarks of this folder (Google Benchmark). Each is named "library/what".

#include <benchmark/benchmark.h>

#include "gelslam/core/error.hpp"
#include "studies/study.hpp"

namespace gelslam::lab {
namespace {

struct Arguments {
  std::string filter;
  bool list = false;
  std::vector<std::string> google;  ///< Options of Google Benchmark.
};

void run(const Arguments& arguments) {
  std::vector<std::string> words = {"gelslam-lab micro-benchmarks"};
  if (!arguments.filter.empty()) words.push_back("--benchmark_filter=" + arguments.filter);
  if (arguments.list) words.emplace_back("--benchmark_list_tests=true");
  words.insert(words.end(), arguments.google.begin(), arguments.google.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  int count = static_cast<int>(pointers.size());
  benchmark::Initialize(&count, pointers.data());
  if (count > 1) throw Error(std::string("Google Benchmark does not know the option ") + pointers[1]);
  if (benchmark::RunSpecifiedBenchmarks() == 0)
    throw Error("no micro-benchmark is called " + arguments.filter);
}

}  // namespace

void add_micro_benchmarks(CLI::App& lab) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_study(lab, "micro-benchmarks", "Time single stages on one thread", arguments, run);
  command->add_option("FILTER", arguments->filter,
                      "Regular expression, such as registration/ (default: all)");
  command->add_flag("--list", arguments->list, "Print the names");
  command->allow_extras();
  command->callback([arguments, command] {
    arguments->google = command->remaining();
    run(*arguments);
  });
  command->footer(
      "Options of Google Benchmark are passed on.\n"
      "Example: gelslam-lab micro-benchmarks chain/ --benchmark_repetitions=5");
}

}  // namespace gelslam::lab
