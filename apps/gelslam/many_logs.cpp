#include "many_logs.hpp"

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "child_program.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

/// What a run's report.json says of it.
struct RunFigures {
  std::string log, warning;
  bool partial = true;
  std::int64_t frames = 0, tracked = 0, in_mesh = 0;
  int pieces = 0, keyframes = 0, loops = 0;
  double seconds = 0;
};

/// Nothing where there is no finished report.
std::optional<RunFigures> read_figures(const fs::path& run) {
  std::ifstream stream(run / "report.json");
  try {
    const nlohmann::json report = nlohmann::json::parse(stream);
    const nlohmann::json& frames = report.at("frames");
    std::string warning = report.value("warning", "");
    for (const std::string& sentence : read_reservations(run)) append_sentence(warning, sentence);
    return RunFigures{report.value("log", ""), warning,
                      report.at("partial"),    frames.at("total"),
                      frames.at("tracked"),    frames.at("in_map"),
                      report.at("components"), report.at("keyframes"),
                      report.at("loops"),      report.at("seconds")};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

struct LogTask {
  std::string log;
  fs::path run;
  bool replaces = false;         // a run that was stopped early
  bool was_finished = false;     // before this command
  bool has_settings = false;     // this command's, which a finished run does not get
  std::optional<int> exit_code;  // of its process; none: not started
  std::string last_line;
  std::unique_ptr<ChildProgram> process;  // while it runs

  std::string name() const { return run.filename().string(); }
};

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return a == b || fs::equivalent(a, b, code);
}

std::vector<LogTask> tasks_of(const ManyLogs& request) {
  std::error_code code;
  if (fs::exists(request.folder, code) && !fs::is_directory(request.folder, code))
    throw Error(request.folder.string() + ": is a file; name a folder for the runs of several logs");
  if (fs::exists(request.folder / "report.json", code))
    throw Error(request.folder.string() + ": is a run; name a folder for the runs of several logs");
  std::vector<LogTask> tasks;
  std::map<std::string, std::string> log_of;
  for (const std::string& log : request.logs) {
    const std::string name = run_name(log);
    if (name.empty())
      throw Error(gelslam::quoted(log) + " has no name by which its run folder could be called");
    const auto [other, is_new] = log_of.emplace(name, log);
    if (!is_new && same_file(other->second, log)) throw Error(log + ": is given twice");
    if (!is_new)
      throw Error(other->second + " and " + log + " would both go to " + (request.folder / name).string() +
                  "; rename one, or reconstruct them into two folders");
    LogTask task;
    task.log = log;
    task.run = request.folder / name;
    task.has_settings = std::any_of(request.options.begin(), request.options.end(),
                                    [](const std::string& option) { return option != "--quiet"; });
    const std::optional<RunFigures> figures = read_figures(task.run);
    if (figures && !request.overwrite && same_file(figures->log, log)) {
      task.was_finished = !figures->partial;
      task.replaces = figures->partial;
    }
    tasks.push_back(std::move(task));
  }
  return tasks;
}

double free_memory_gb() {
  std::ifstream stream("/proc/meminfo");
  double kilobytes = 0;
  for (std::string key; stream >> key;)
    if (key == "MemAvailable:" && stream >> kilobytes) break;
  return kilobytes / 1e6;
}

/// One process for each core (tracking uses one), as far as memory allows.
int default_jobs(std::string& why) {
  constexpr double kMemoryOfALogGb = 1.0;  // a minute's scan around an object takes 0.3
  const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const double memory_gb = free_memory_gb();
  why = fmt::format(" ({}, {} GB of free memory, {} GB for each log)", counted(cores, "core"),
                    short_number(memory_gb, 2), short_number(kMemoryOfALogGb));
  return std::clamp(static_cast<int>(memory_gb / kMemoryOfALogGb), 1, cores);
}

/// What became of a log.
struct Outcome {
  int exit_code = kExitDone;
  std::optional<RunFigures> figures;  ///< none: there is no run of it
  std::string note;
};

Outcome outcome_of_run(const LogTask& task) {
  Outcome outcome{kExitDone, read_figures(task.run), task.was_finished ? "finished before" : ""};
  if (task.was_finished && task.has_settings)
    outcome.note += " (with the settings of then; --overwrite makes it again)";
  if (!outcome.figures) return {kExitInternalError, {}, "failed: its run cannot be read"};
  const auto add = [&](const std::string& more) { append_sentence(outcome.note, more); };
  if (outcome.figures->partial) add("stopped early");
  if (outcome.figures->tracked == 0) add("nothing touched the sensor");
  if (outcome.figures->partial || outcome.figures->tracked == 0) outcome.exit_code = kExitNotGood;
  if (!outcome.figures->warning.empty()) add("warning: " + outcome.figures->warning);
  return outcome;
}

Outcome outcome_of(const LogTask& task) {
  constexpr std::string_view kErrorPrefix = "gelslam: error: ";
  if (task.was_finished) return outcome_of_run(task);
  if (!task.exit_code) return {kExitNotGood, {}, "not started"};
  const int code = *task.exit_code;
  const bool known = task.last_line.starts_with(kErrorPrefix), stopped = code > kExitStoppedBySignal;
  if (code == kExitDone || code == kExitNotGood || (stopped && !known)) return outcome_of_run(task);
  if (code == -SIGINT) return {kExitNotGood, {}, "stopped"};
  if (code > 0) {
    return {code, {}, "failed: " + task.last_line.substr(known ? kErrorPrefix.size() : 0)};
  }
  return {kExitInternalError,
          {},
          fmt::format("failed: ended by signal {} ({}){}", -code, ::strsignal(-code),
                      code == -SIGKILL ? "; if memory was short, use fewer --jobs" : "")};
}

using Row = std::vector<std::string>;

Row row_of(const std::string& name, const Outcome& outcome) {
  if (!outcome.figures) return {name, "-", "-", "-", "-", "-", "-", outcome.note};
  const RunFigures& f = *outcome.figures;
  return {name,
          std::to_string(f.frames),
          std::to_string(f.in_mesh),
          std::to_string(f.pieces),
          std::to_string(f.keyframes),
          std::to_string(f.loops),
          duration_text(f.seconds),
          outcome.note};
}

/// Names and notes to the left, figures to the right.
std::string table_text(const std::vector<Row>& rows) {
  std::vector<std::size_t> width(rows.front().size());
  for (const Row& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string text;
  for (const Row& row : rows) {
    std::string line = fmt::format("{:<{}}", row.front(), width.front());
    for (std::size_t c = 1; c + 1 < row.size(); ++c) line += fmt::format("  {:>{}}", row[c], width[c]);
    line += "  " + row.back();
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

class ManyLogsRun {
 public:
  explicit ManyLogsRun(const ManyLogs& request) : request_(request), tasks_(tasks_of(request)) {
    for (LogTask& task : tasks_)
      if (!task.was_finished) waiting_.push_back(&task);
    std::reverse(waiting_.begin(), waiting_.end());  // taken from its end
  }

  int run() {
    if (!waiting_.empty()) work();
    return report();
  }

 private:
  void work() {
    const InterruptWatch interrupt(2);
    const std::unique_ptr<ProgressSink> progress = make_progress(request_.quiet);
    const int jobs = announce();
    progress->begin("reconstructing", static_cast<std::int64_t>(waiting_.size()));
    int passed_on = 0;
    for (std::int64_t done = 0; !running_.empty() || (!waiting_.empty() && !interrupt.requested());) {
      while (!waiting_.empty() && static_cast<int>(running_.size()) < jobs && !interrupt.requested())
        start_next();
      for (; passed_on < interrupt.requests(); ++passed_on)
        for (const LogTask* task : running_) task->process->interrupt();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      done += static_cast<std::int64_t>(
          std::erase_if(running_, [this](LogTask* task) { return has_ended(*task); }));
      progress->update(done);
    }
    progress->end();
  }

  int announce() const {
    std::string why;
    const int wanted = request_.jobs > 0 ? request_.jobs : default_jobs(why);
    const int jobs = std::min(wanted, static_cast<int>(waiting_.size()));
    if (!request_.quiet)
      std::cerr << counted(static_cast<std::int64_t>(waiting_.size()), "log") << ", " << jobs << " at a time"
                << why << "\n";
    return jobs;
  }

  void start_next() {
    LogTask& task = *waiting_.back();
    waiting_.pop_back();
    std::vector<std::string> words{"reconstruct", "--output=" + task.run.string()};
    words.insert(words.end(), request_.options.begin(), request_.options.end());
    if (request_.overwrite || task.replaces) words.emplace_back("--overwrite");
    words.insert(words.end(), {"--", task.log});
    try {
      task.process = std::make_unique<ChildProgram>(words);
      running_.push_back(&task);
    } catch (const Error& error) {
      task.exit_code = kExitInternalError;
      task.last_line = error.what();
    }
  }

  bool has_ended(LogTask& task) const {
    task.exit_code = task.process->exit_code();
    if (!task.exit_code) return false;
    task.last_line = task.process->last_line();
    task.process.reset();
    const Outcome outcome = outcome_of(task);
    const bool warns = outcome.figures && !outcome.figures->warning.empty();
    if (request_.quiet && outcome.exit_code <= kExitNotGood && !warns) return true;
    // One write: the progress line is drawn by another thread.
    std::cerr << fmt::format("{}{}: {}\n", ::isatty(STDERR_FILENO) != 0 ? "\r\x1b[K" : "", task.name(),
                             outcome.note.empty() ? "done" : outcome.note);
    return true;
  }

  int report() const {
    std::vector<Row> rows{{"log", "frames", "in mesh", "pieces", "keyframes", "loops", "time", ""}};
    int worst = kExitDone;
    for (const LogTask& task : tasks_) {
      const Outcome outcome = outcome_of(task);
      rows.push_back(row_of(task.name(), outcome));
      worst = std::max(worst, outcome.exit_code);
    }
    if (!request_.quiet) std::cout << table_text(rows);
    return worst;
  }

  const ManyLogs& request_;
  std::vector<LogTask> tasks_;
  std::vector<LogTask*> waiting_, running_;
};

}  // namespace

std::string run_name(const fs::path& log) {
  if (log.empty()) return "";
  fs::path path = fs::absolute(log).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // "data/pebble/"
  std::error_code code;
  if (fs::is_directory(path, code)) return path.filename().string();
  const fs::path name = path.filename();
  const bool named_by_folder = name == "gelsight.avi" || name == "log.mkv";
  return (named_by_folder ? path.parent_path().filename() : path.stem()).string();
}

int reconstruct_each(const ManyLogs& request) { return ManyLogsRun(request).run(); }

}  // namespace gelslam
