#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "gelslam/core/text.hpp"
#include "info_report.hpp"
#include "terminal_progress.hpp"

namespace gelslam {

InfoReport::InfoReport(const std::filesystem::path& path, const std::string& kind)
    : path_(path.string()), kind_(kind) {}

void InfoReport::add(const std::string& key, nlohmann::ordered_json value, const std::string& words) {
  facts_.push_back({key, std::move(value), words});
}

void InfoReport::add_problem(const std::string& words) { problems_.push_back(one_line(words)); }

std::string InfoReport::text() const {
  std::size_t widest = std::string("problem").size();
  for (const Fact& fact : facts_) widest = std::max(widest, fact.key.size());
  std::string text = one_line(path_) + ": " + kind_ + "\n";
  const auto line = [&](const std::string& key, const std::string& words) {
    text +=
        "  " + key + std::string(widest + 2 - key.size(), ' ') +
        (key == "missing" || key == "uncertain" ? amber(one_line(words), STDOUT_FILENO) : one_line(words)) +
        "\n";
  };
  for (const Fact& fact : facts_) line(fact.key, fact.words);
  for (const std::string& problem : problems_) line("problem", problem);
  return text;
}

std::string InfoReport::json() const {
  using Json = nlohmann::ordered_json;
  Json object{{"path", path_}, {"kind", kind_}};
  for (const Fact& fact : facts_) object[fact.key] = fact.value;
  object["problems"] = problems_;
  // File names may be of any bytes; what is not UTF-8 is replaced instead of refused.
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

namespace {

struct InfoArguments {
  std::filesystem::path path;
  bool json = false, quiet = false;
};

int run_info(const InfoArguments& arguments) {
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const InfoReport report = inspect(arguments.path, *progress);
  std::cout << (arguments.json ? report.json() : report.text());
  return report.has_problems() ? kExitNotGood : kExitDone;
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("info", "Say what a file or folder is, and what is in it");
  const auto arguments = std::make_shared<InfoArguments>();
  command
      ->add_option("PATH", arguments->path,
                   "Log, video, folder of images, data folder, run or a file of it, surface folder, "
                   "calibration presses, model, configuration, mesh or .npy")
      ->required();
  command->add_flag("--json", arguments->json, "Print one JSON object for another program");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam info RUN --json\nExit code 1: something is wrong with it; the output says what.");
  command->callback([arguments, &exit_code] { exit_code = run_info(*arguments); });
}

}  // namespace gelslam
