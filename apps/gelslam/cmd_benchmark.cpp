#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "commands.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

/// Replaces this process by gelslam-lab, which lies beside the program.
[[noreturn]] void run_lab(const std::vector<std::string>& arguments) {
  std::error_code failure;
  const std::filesystem::path lab =
      std::filesystem::read_symlink("/proc/self/exe", failure).parent_path() / "gelslam-lab";
  if (failure || !std::filesystem::exists(lab))
    throw Error(
        "'gelslam benchmark' is now 'gelslam-lab benchmark', which is not built; build it with "
        "scripts/build.sh --lab");
  std::cerr << "gelslam: note: 'gelslam benchmark' is now 'gelslam-lab benchmark'" << std::endl;
  std::vector<std::string> words = {lab.string(), "benchmark"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  execv(pointers[0], pointers.data());
  throw Error("cannot run " + lab.string() + ": " + std::strerror(errno));
}

}  // namespace

void add_benchmark_command(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("benchmark", "Moved: see gelslam-lab benchmark");
  command->prefix_command();
  command->set_help_flag();  // --help is passed on, too
  command->callback([command] { run_lab(command->remaining()); });
}

}  // namespace gelslam
