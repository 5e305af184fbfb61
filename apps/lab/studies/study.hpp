#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gelslam::lab {

using Json = nlohmann::ordered_json;

/// Each study is in its own file, which adds a subcommand with its options and a callback that does the work
/// and owns the arguments. Errors are thrown as Error and printed by main().
void add_ablation(CLI::App& lab);
void add_benchmark(CLI::App& lab);
void add_contact(CLI::App& lab);
void add_long_scan(CLI::App& lab);
void add_localize(CLI::App& lab);
void add_micro_benchmarks(CLI::App& lab);
void add_soak(CLI::App& lab);
void add_speed_accuracy(CLI::App& lab);
void add_stability(CLI::App& lab);

/// Adds the subcommand `name`, which calls `run(arguments)`; the caller adds the options.
template <class Arguments>
CLI::App* add_study(CLI::App& lab, const char* name, const char* description,
                    const std::shared_ptr<Arguments>& arguments, void (*run)(const Arguments&)) {
  CLI::App* command = lab.add_subcommand(name, description);
  command->callback([arguments, run] { run(*arguments); });
  return command;
}

/// Adds an option that takes several values, separated by commas.
template <class Values>
CLI::Option* add_list(CLI::App& app, const char* name, Values& values, const std::string& help) {
  return app.add_option(name, values, help)->delimiter(',')->allow_extra_args(false);
}

/// Throws Error if one of the methods is unknown.
void check_methods(const std::vector<std::string>& methods);

/// Returns the processor time of this thread, on which other programs have little influence.
double thread_cpu_ms();

/// Prints on stderr which case of a long study begins, how many there are, and the remaining time.
class StudyCases {
 public:
  explicit StudyCases(std::size_t total) : total_(total) {}
  void begin(const std::string& name);

 private:
  using Clock = std::chrono::steady_clock;
  std::size_t total_, begun_ = 0;
  Clock::time_point start_ = Clock::now();
};

/// Writes a table (an array of objects with the same keys) as folder/name.json and creates the folder; has no
/// effect if `folder` is empty. Long studies call it after each step. Throws Error.
void write_study(const std::filesystem::path& folder, const std::string& name, const Json& rows);

/// Prints such a table as CSV.
void print_csv(const Json& rows);

}  // namespace gelslam::lab
