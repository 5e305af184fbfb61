// Study: the effect of each mechanism of the system. For every log, whole reconstructions and tracking alone
// are run with everything on and with one mechanism off. Reported are errors of poses and mesh, undetected
// errors, the consistency of the stated standard deviations, and times.

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "ablation_case.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/core/text.hpp"
#include "protocols/trials.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBaseline = "everything on";
constexpr const char* kOwnModel = "default";

struct AblationArguments {
  std::vector<fs::path> data;
  std::vector<std::string> only, set, models = {kOwnModel};
  fs::path config, out;
  int threads = 1;
};

/// A log and the set to which it belongs. A folder that contains folders is a set of logs.
struct Log {
  std::string set;
  fs::path path;
};

std::vector<Log> logs_in(const std::vector<fs::path>& data) {
  std::vector<Log> logs;
  std::set<std::pair<std::string, std::string>> names;
  const auto add = [&](const std::string& set, const fs::path& path) {
    if (!names.emplace(set, name_of(path)).second)
      throw Error(path.string() + ": there is another log " + name_of(path) + " of the set " + set);
    logs.push_back({set, path});
  };
  for (const fs::path& path : data) {
    if (!fs::exists(path)) throw Error(path.string() + ": no such file or folder");
    const std::vector<fs::path> members = subfolders(path);
    for (const fs::path& member : members) add(name_of(path), member);
    if (members.empty()) add(name_of(fs::absolute(path).lexically_normal().parent_path()), path);
  }
  return logs;
}

/// Without ground truth, the first frames may show contact. For such a log, background.png beside it is used.
LogInput input_of(const AblationArguments& arguments, const Log& log, const std::string& model) {
  LogInput input{.log = log.path};
  if (!arguments.config.empty()) input.config = arguments.config;
  if (model != kOwnModel) input.model = model;
  const fs::path background = fs::absolute(log.path).lexically_normal().parent_path() / "background.png";
  if (!fs::exists(truth_file(log.path)) && fs::exists(background)) input.background = background;
  return input;
}

std::vector<AblationCase> cases_of(const AblationArguments& arguments) {
  std::vector<AblationCase> cases;
  for (const Log& log : logs_in(arguments.data))
    for (const std::string& model : arguments.models) {
      const LogInput input = input_of(arguments, log, model);
      cases.push_back({log.set, name_of(log.path), model, input, resolve_config(input)});
    }
  return cases;
}

/// Returns the variants, beginning with the complete system.
std::vector<Variant> variants_of(const AblationArguments& arguments) {
  std::vector<Variant> variants = {{kBaseline, {}}};
  const bool all = arguments.only.empty() && arguments.set.empty();
  for (const Variant& variant : mechanism_variants())
    if (all || std::find(arguments.only.begin(), arguments.only.end(), variant.name) != arguments.only.end())
      variants.push_back(variant);
  for (const std::string& text : arguments.set) variants.push_back(parse_variant(text));
  std::set<std::string> names;
  for (const Variant& variant : variants) {
    with_settings(Config{}, variant);  // Reports errors before the work begins.
    if (!names.insert(variant.name).second) throw Error("two variants are called " + variant.name);
  }
  return variants;
}

/// The rows of the finished cases, in the order of the cases.
class Results {
 public:
  Results(std::size_t cases, fs::path out) : out_(std::move(out)), progress_(cases), rows_(cases) {}

  void measure(std::size_t index, const AblationCase& measured, const std::vector<Variant>& variants) {
    const std::string name = measured.set + "/" + measured.sequence;
    {
      const std::lock_guard lock(mutex_);
      progress_.begin(name);
    }
    Json rows = Json::array();
    std::string failure;
    try {
      rows = measure_case(measured, variants);
      // An error in one log must not end the study, because the other logs take hours.
    } catch (const std::exception& error) {
      failure = error.what();
    }
    const std::lock_guard lock(mutex_);
    if (!failure.empty()) std::cerr << "warning: " << name << ": " << one_line(failure) << std::endl;
    failures_ += failure.empty() ? 0 : 1;
    rows_[index] = std::move(rows);
    write_study(out_, "ablation", all());
  }

  Json all() const {
    Json rows = Json::array();
    for (const Json& of_case : rows_)
      for (const Json& row : of_case) rows.push_back(row);
    return rows;
  }
  int failures() const { return failures_; }

 private:
  const fs::path out_;
  std::mutex mutex_;
  StudyCases progress_;
  std::vector<Json> rows_;
  int failures_ = 0;
};

void run(const AblationArguments& arguments) {
  const std::vector<Variant> variants = variants_of(arguments);
  const std::vector<AblationCase> cases = cases_of(arguments);
  Results results(cases.size(), arguments.out);
  parallel_for(cases.size(), arguments.threads,
               [&](std::size_t i) { results.measure(i, cases[i], variants); });
  const Json rows = results.all(), ratios = ablation_ratios(rows, kBaseline);
  write_study(arguments.out, "ablation_ratios", ratios);
  print_csv(ratios.empty() ? rows : ratios);
  if (results.failures() > 0) throw CLI::RuntimeError(1);
}

std::vector<std::string> mechanism_names() {
  std::vector<std::string> names;
  for (const Variant& variant : mechanism_variants()) names.push_back(variant.name);
  return names;
}

}  // namespace

void add_ablation(CLI::App& lab) {
  const auto arguments = std::make_shared<AblationArguments>();
  CLI::App* command =
      add_study(lab, "ablation", "Measure every mechanism of the chain with and without it", arguments, run);
  command
      ->add_option("DATA", arguments->data,
                   "Logs and data folders, or folders of them; without truth only frames are counted")
      ->required();
  add_list(*command, "--only", arguments->only, "Only these mechanisms (default: all)")
      ->check(CLI::IsMember(mechanism_names()));
  command
      ->add_option(
          "--set", arguments->set,
          "Another variant: \"name: key=value, key=value\", keys of the configuration; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--model", arguments->models,
                   "Gradient model, or \"default\" for the one that the log names; may be repeated")
      ->allow_extra_args(false)
      ->capture_default_str();
  command->add_option("--config", arguments->config, "Configuration of all logs (default: their own)");
  command
      ->add_option("--threads", arguments->threads,
                   "Logs at a time (0: one per core); times are comparable with 1 only")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command->add_option("-o,--output", arguments->out, "Folder for ablation.json and ablation_ratios.json");
  command->footer(
      "Example: gelslam-lab ablation DATA/sequences DATA/ablation --only \"gradient scale\" -o STUDY && "
      "scripts/plot_ablation.py STUDY\n"
      "Sums in Python: pandas.read_json(\"STUDY/ablation_ratios.json\").groupby([\"without\", "
      "\"set\"]).error.describe()");
}

}  // namespace gelslam::lab
