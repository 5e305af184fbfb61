#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <opencv2/core/utility.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

void add_commands(CLI::App& app, int& exit_code) {
  for (const auto add :
       {add_calibrate_command, add_devices_command, add_evaluate_command, add_export_command,
        add_fuse_command, add_info_command, add_map_command, add_reconstruct_command, add_record_command,
        add_scan_command, add_simulate_command, add_surface_command, add_track_command, add_view_command})
    add(app, exit_code);
}

/// Returns the subcommand (or its subcommand) that was chosen, else the program itself. Its full name is
/// appended to `name`.
const CLI::App& chosen_command(const CLI::App& app, std::string& name) {
  name += app.get_name();
  const auto chosen = app.get_subcommands();
  if (chosen.empty()) return app;
  name += " ";
  return chosen_command(*chosen.front(), name);
}

/// Returns everything that could have been meant on this command line: option names and subcommands.
std::vector<std::string> known_words(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  }
  for (const CLI::App* sub : command.get_subcommands({})) words.push_back(sub->get_name());
  return words;
}

std::string did_you_mean(const CLI::App& command) {
  for (const std::string& word : command.remaining()) {
    const std::string near = nearest_name(word.substr(0, word.find('=')), known_words(command));
    if (!near.empty()) return ", did you mean " + near + "?";
  }
  return "";
}

void print_error(const std::string& message) { print_line("gelslam: error: " + message); }

int report_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  std::string name;
  const CLI::App& command = chosen_command(app, name);
  std::string words = error.what();
  const bool lacks_command = command.get_subcommands().empty() && !command.get_subcommands({}).empty() &&
                             command.remaining_size() > 0 && !command.remaining().front().starts_with('-');
  if (!lacks_command && error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success))
    return app.exit(error);  // For --help and --version.
  if (lacks_command)
    words = "there is no " + name + " " + command.remaining().front() + did_you_mean(command);
  else if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)
    words += did_you_mean(command);
  print_error(words + " (see " + name + " --help)");
  return kExitUserError;
}

int run(int argc, char** argv) {
  CLI::App app{"Tactile SLAM: track an object rolled across a touch sensor, and reconstruct its surface."};
  app.name("gelslam");
  app.set_version_flag("--version", "gelslam " GELSLAM_VERSION);
  app.require_subcommand(0, 1);
  app.footer(
      "Example: gelslam reconstruct LOG -o RUN\nEach command has its own help: gelslam COMMAND --help");
  int exit_code = kExitDone;
  add_commands(app, exit_code);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) std::cout << app.help();
  } catch (const CLI::ParseError& error) {
    exit_code = report_parse_error(app, error);
  }
  std::cout.flush();
  if (!std::cout) throw Error("cannot write to standard output; is the disk full?");
  return exit_code;
}

int failed(int exit_code, const std::string& message) {
  print_error(message);
  return exit_code;
}

int run_and_report(int argc, char** argv) {
  constexpr const char* no_memory = "there is not enough memory";
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    return failed(kExitUserError, error.what());
    // A path that is invalid or may not be accessed.
  } catch (const std::filesystem::filesystem_error& error) {
    return failed(kExitUserError, error.path1().string() + ": " + error.code().message());
  } catch (const std::system_error& error) {  // For example no thread or file descriptor is left.
    return failed(kExitUserError, std::string("the system refuses: ") + error.what());
  } catch (const std::bad_alloc&) {
    return failed(kExitUserError, no_memory);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) return failed(kExitUserError, no_memory);
    return failed(kExitInternalError, std::string("internal error: ") + error.what());
  } catch (const std::exception& error) {
    return failed(kExitInternalError, std::string("internal error: ") + error.what());
  } catch (...) {
    return failed(kExitInternalError, "internal error of unknown kind");
  }
}

}  // namespace
}  // namespace gelslam

int main(int argc, char** argv) {
  // A file that exceeds its size limit then causes a failed write, which is reported and cleaned up.
  std::signal(SIGXFSZ, SIG_IGN);
  cv::setNumThreads(1);  // Images are small, and the program's own threads do the work.
  const int exit_code = gelslam::run_and_report(argc, argv);
  const int signal = gelslam::InterruptWatch::ended_early_by();
  return signal == 0 || exit_code == gelslam::kExitInternalError ? exit_code
                                                                 : gelslam::kExitStoppedBySignal + signal;
}
