#include "live_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <iostream>
#include <set>
#include <stop_token>
#include <thread>

#include "camera_input.hpp"
#include "commands.hpp"
#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/folder_update.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "gelslam/slam/sensor_rig.hpp"
#include "gelslam/viewer/gl_context.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;

/// Passes on what a person asks for outside the window: Ctrl-C, once or twice, and --seconds.
class StopWatch {
 public:
  StopWatch(LiveSession& session, const InterruptWatch& interrupt, double seconds)
      : thread_([&session, &interrupt, seconds](const std::stop_token& token) {
          const Clock::time_point start = Clock::now();
          bool stopped = false;
          while (!token.stop_requested()) {
            const bool time_is_up =
                seconds > 0 && std::chrono::duration<double>(Clock::now() - start).count() > seconds;
            if (!std::exchange(stopped, stopped || interrupt.requested() || time_is_up) && stopped)
              session.stop();
            if (interrupt.requests() > 1) return session.abort();
            std::this_thread::sleep_for(std::chrono::milliseconds(30));
          }
        }) {}

 private:
  std::jthread thread_;
};

/// A line in the terminal that is written over, or, where stderr is no terminal, a line for every change of
/// state.
class StatusLine {
 public:
  explicit StatusLine(bool quiet) : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0) {}
  ~StatusLine() {
    if (terminal_ && !last_.empty()) std::cerr << "\r\033[K" << std::flush;
  }

  const std::vector<std::string>& warned() const { return warned_; }

  void show(const LiveStatus& s) {
    if (quiet_) return;
    for (const std::string& warning : s.warnings) {
      std::string kind = warning;  // some count what they warn of; the last word is said at the end
      std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
      if (!kinds_.insert(std::move(kind)).second) continue;
      if (terminal_) std::cerr << "\r\033[K";
      warn(warning);
      warned_.push_back(warning);
    }
    const std::string progress = s.progress.empty() ? "" : ": " + s.progress;
    const std::string line = terminal_ ? s.words + progress + figures(s) : s.words;
    if (line == last_ || line.empty()) return;
    std::cerr << (terminal_ ? "\r\033[K" : "") << line << (terminal_ ? "" : "\n") << std::flush;
    last_ = line;
  }

 private:
  static std::string figures(const LiveStatus& s) {
    std::string text = fmt::format(" | {:.1f} Hz, {:.1f} ms | {}, {}, {}", s.rate_hz, s.latency_ms,
                                   counted(s.keyframes, "keyframe"), counted(s.loops, "loop"),
                                   counted(s.components, "piece"));
    if (s.lost_by_camera + s.dropped + s.damaged > 0)
      text += fmt::format(" | {} lost, {} dropped, {} damaged", s.lost_by_camera, s.dropped, s.damaged);
    return text;
  }

  const bool quiet_, terminal_;
  std::string last_;
  std::vector<std::string> warned_;
  std::set<std::string> kinds_;
};

/// Returns the warnings that it said.
std::vector<std::string> wait_in_terminal(const LiveSession& session, bool quiet) {
  StatusLine line(quiet);
  while (session.status().phase != LivePhase::finished) {
    line.show(session.status());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return line.warned();
}

/// `warned`: what was said already.
std::string report_text(RunReport r, const LiveStatus& status, const std::vector<std::string>& warned,
                        bool quiet) {
  for (const std::string& said : warned) std::erase(r.warnings, said);
  std::string text = warning_words(r.warnings) + warning_words(r.reservations);
  if (quiet) return text;
  for (const std::string& part : r.parts) text += part + "\n";
  text += fmt::format("{} in {:.1f} s, {} lost by the camera, {} dropped, {} damaged\n",
                      counted(status.frames, "frame"), r.seconds, status.lost_by_camera, status.dropped,
                      status.damaged);
  text += fmt::format("{} tracked, {}\n{}{}\n", r.frames.tracked, map_words(r), mesh_words(r),
                      status.run_folder.empty() ? ", not kept (no -o)" : ": " + status.run_folder);
  return text;
}

/// RUN-2, RUN-3, ...: the first that is not there, nor its sensors'.
std::filesystem::path next_run_folder(const std::filesystem::path& folder) {
  const std::filesystem::path clean = folder.has_filename() ? folder : folder.parent_path();
  for (int number = 2;; ++number) {
    std::filesystem::path next = clean;
    next += "-" + std::to_string(number);
    std::error_code code;
    const auto exists = [&](const std::filesystem::path& path) {
      return std::filesystem::exists(path, code);
    };
    if (!exists(next) && !exists(run_of_sensor(next, 0, 2)) && !exists(run_of_sensor(next, 1, 2)))
      return next;
  }
}

}  // namespace

void LiveArguments::add_to(CLI::App& command) {
  CLI::Option* output = command.add_option(
      "-o,--output", run_folder, "Run folder to write: mesh, trajectory, report; with a scan, its log");
  add_overwrite_flag(command, overwrite);
  command
      .add_option(
          "--continue", continued,
          "Run folder to continue in place, also after a crash: new frames join its map (of two sensors: "
          "at the end)")
      ->excludes(output)
      ->excludes("--overwrite");
  log.add_to(command);
  command.add_option("--seconds", seconds, "Stop after this many seconds")->check(number_between(0.01, 1e6));
  command.add_flag("--headless", headless, "No window: the state is printed in the terminal");
  command.add_option("--snapshot", snapshot, "Picture of the window at the end (PNG; also with --headless)")
      ->check(refuse_unless_png);
  command.add_option("--script", script, "File of keys and mouse movements for the window (docs/viewer.md)");
  add_ui_scale(command, ui_scale);
  command.add_option("--rig", rig,
                     "Of two sensors: how they are fixed to each other (rig.yaml, or a run of theirs; "
                     "default: the motions tell)");
  stream.add_to(command);
  stream.add_live_to(command);
  add_quiet_flag(command, quiet);
}

LiveOptions LiveArguments::options_of(Config config, int sensor, int sensors) const {
  LiveOptions options;
  options.show_mesh = !headless || !snapshot.empty();
  options.background = log.background;
  options.force = log.force;
  options.background_frames = log.named_frames();
  options.overwrite = overwrite;
  if (continued.empty()) {
    options.run_folder = run_of_sensor(run_folder, sensor, sensors);
  } else {
    const bool of_several = is_of_several_sensors(continued);
    if (of_several) config.slam.gradient_scale = {};  // off in that run, whose surfaces are corrected
    if (of_several || sensors > 1) {
      if (sensor == 0) check_can_be_merged(continued);
      options.run_folder = next_run_folder(run_of_sensor(continued, sensor, sensors));
    } else {
      options.run_folder = continued;
      options.continued = continue_in_place(continued, config);
    }
  }
  options.config = config;
  if (sensor == 0) options.stream = stream.open(config.slam.gradient_scale.sigma, quiet);
  return options;
}

std::vector<Config> LiveArguments::configs(const std::vector<std::string>& logs) const {
  if (!continued.empty()) finish_update(continued);
  std::vector<Config> of_sensor;
  for (std::size_t sensor = 0; sensor < logs.size(); ++sensor)
    of_sensor.push_back(
        resolve_config(with_settings_of_run(log.input(logs[sensor], sensor, logs.size()), continued)));
  return of_sensor;
}

std::vector<LiveOptions> LiveArguments::options(const std::vector<Config>& configs) const {
  const int sensors = static_cast<int>(configs.size());
  if (sensors == 1 && !rig.empty()) throw Error("--rig is for two sensors");
  if (sensors > 1 && run_folder.empty() && continued.empty())
    throw Error("two sensors need a run folder: -o RUN");
  if (sensors > 1 && !stream.target.empty() && stream.stream_format() == StreamFormat::tum)
    throw Error("--stream-format tum does not tell two sensors apart; use ndjson");
  std::vector<LiveOptions> of_sensor;
  for (int sensor = 0; sensor < sensors; ++sensor)
    of_sensor.push_back(options_of(configs[static_cast<std::size_t>(sensor)], sensor, sensors));
  if (sensors > 1 && of_sensor[0].stream)
    of_sensor[1].stream = std::make_shared<PoseStream>(*of_sensor[0].stream);
  return of_sensor;
}

WindowOptions prepare_window(const std::vector<LiveOptions>& of_sensor, const LiveArguments& arguments) {
  for (const LiveOptions& options : of_sensor) check_run_folder(options);
  const LiveOptions& options = of_sensor.front();
  if (std::filesystem::exists(arguments.snapshot)) check_output_file(arguments.snapshot, arguments.overwrite);
  WindowOptions window;
  window.picture_folder = options.run_folder.empty() ? "." : options.run_folder.string();
  window.keeps_run = !options.run_folder.empty();
  window.script = read_script_file(arguments.script);
  window.script_name = arguments.script;
  if (!window.script.empty()) check_window_script(window.script, window.script_name);
  window.snapshot = arguments.snapshot;
  window.ui_scale = arguments.ui_scale;

  if (options.continued) {
    for (const std::string& warning : options.continued->record.warnings) warn(warning);
    if (!arguments.quiet)
      std::cerr << fmt::format("continuing {}: {}\n", options.run_folder.string(),
                               counted(std::ssize(options.continued->record.keyframes), "keyframe"));
  }
  if (!arguments.headless) GlContext::window({.title = "GelSLAM", .visible = false});
  return window;
}

namespace {

/// The exit code, and what to do next with which run folder.
struct LiveEnd {
  int exit_code = kExitDone;
  WindowEnd window;
  std::string run_folder;
  std::vector<BackgroundFrames> backgrounds;  ///< by sensor
};

/// Runs work in a thread that began before drawing lowered its priority: threads inherit it.
class UsualPriority {
 public:
  ~UsualPriority() { work_.close(); }

  template <typename Work>
  auto run(Work work) {
    std::packaged_task<decltype(work())()> task(std::move(work));
    auto result = task.get_future();
    work_.push([&task] { task(); });
    result.wait();
    return result.get();
  }

 private:
  BoundedQueue<std::function<void()>> work_{1};
  std::jthread thread_{[this] {
    while (const auto work = work_.pop()) (*work)();
  }};
};

/// This program begins anew with other arguments, in the same process. Throws Error.
[[noreturn]] void become(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "gelslam");
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  ::execv("/proc/self/exe", words.data());
  throw Error("cannot start gelslam anew: " + errno_text());
}

/// A scan that continues a run of several sensors becomes a part of it.
void join_with_continued(const std::filesystem::path& scan, const LiveArguments& arguments) {
  MergeRequest request{{arguments.continued, scan}, arguments.continued};
  request.in_place = true;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport all = merge_scans(request, *progress, [&] { return interrupt.requested(); }).report;
  std::cerr << run_words(all, arguments.continued, arguments.quiet);
}

LiveEnd run_to_its_end(RawFrameSources sources, std::vector<LiveOptions> options, const LiveRigOptions& rig,
                       const LiveArguments& arguments, WindowOptions window, UsualPriority& usual_priority) {
  LiveEnd end;
  // Before there is anything that must not be left behind.
  const InterruptWatch interrupt(
      2, options.front().log.empty() ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early);
  std::atomic<bool> shown{arguments.headless};
  for (LiveOptions& of_sensor : options) of_sensor.begins = [&shown] { return shown.load(); };
  const auto session = usual_priority.run([&] { return begin_live(std::move(sources), options, rig); });
  window.when_shown = [&] { shown = true; };
  const StopWatch stop_watch(*session, interrupt, arguments.seconds);
  if (!arguments.headless) {
    window.asks_to_end = [&] { return interrupt.requested(); };
    end.window = run_live_window(*session, window);
    session->stop();
  }
  const std::vector<std::string> warned = wait_in_terminal(*session, arguments.quiet);
  const RunReport report = session->wait();
  if (arguments.headless && !arguments.snapshot.empty())
    write_live_snapshot(*session, arguments.snapshot, window);
  std::cerr << report_text(report, session->status(), warned, arguments.quiet);
  end.exit_code = report.frames.tracked == 0 || report.partial ? kExitNotGood : kExitDone;
  end.run_folder = session->status().run_folder;
  end.backgrounds = session->background_frames();
  if (interrupt.requested()) end.window.next = NextStep::none;
  return end;
}

/// The cameras, opened once more, after what was the background of the scan before.
RawFrameSources open_again(const NextScans& next, std::vector<BackgroundFrames> backgrounds) {
  RawFrameSources cameras = next.open();
  double begins_s = 0;  // one start for both sensors
  for (std::size_t i = 0; i < cameras.size(); ++i)
    begins_s = std::max(begins_s, static_cast<double>(backgrounds[i].size()) / cameras[i]->rate_hz());
  for (std::size_t i = 0; i < cameras.size(); ++i)
    cameras[i] = after_background(std::move(backgrounds[i]), std::move(cameras[i]), begins_s);
  return cameras;
}

void prepare_next_scan(LiveOptions& options, const Config& config, const std::filesystem::path& run_folder) {
  options.config = config;  // a scan that continues another may have a changed one
  options.run_folder = run_folder;
  options.overwrite = false;
  options.continued.reset();
  if (options.stream) options.stream->start_scan();
}

}  // namespace

int run_live(RawFrameSources sources, std::vector<LiveOptions> options, const LiveArguments& arguments,
             WindowOptions window, const NextScans& next) {
  const int sensors = static_cast<int>(options.size());
  window.can_go_on = !next.go_on.empty();
  const bool goes_on = !arguments.continued.empty();
  const std::filesystem::path first = goes_on ? arguments.continued : arguments.run_folder;
  LiveRigOptions rig{first, arguments.overwrite, arguments.rig, goes_on};
  bool joins = goes_on && sensors == 1 && !options.front().continued;
  UsualPriority usual_priority;
  if (!arguments.headless) lower_thread_priority();  // drawing goes after tracking
  LiveEnd end;
  for (int exit_code = kExitDone;;) {  // scan after scan, as long as the person begins another one
    const std::filesystem::path next_folder = next.open ? next_run_folder(first) : "";
    window.next_run_folder = next_folder.string();
    end = run_to_its_end(std::move(sources), options, rig, arguments, window, usual_priority);
    if (std::exchange(joins, false)) {
      join_with_continued(options.front().run_folder, arguments);
      end.run_folder = arguments.continued;
    }
    end.exit_code = exit_code = std::max(exit_code, end.exit_code);
    if (end.window.next != NextStep::new_scan) break;
    window.script = end.window.script;
    window.picture_folder = next_folder;
    rig = {next_folder, false, arguments.rig, false};
    sources = open_again(next, std::move(end.backgrounds));
    for (int sensor = 0; sensor < sensors; ++sensor)
      prepare_next_scan(options[static_cast<std::size_t>(sensor)],
                        next.configs[static_cast<std::size_t>(sensor)],
                        run_of_sensor(next_folder, sensor, sensors));
  }
  if (const auto& stream = options.front().stream; stream && !stream->finish())
    std::cout.setstate(std::ios::badbit);  // main() says so
  if (end.window.next == NextStep::none) return end.exit_code;
  std::vector<std::string> words =
      end.window.next == NextStep::view ? std::vector<std::string>{"view"} : next.go_on;
  words.push_back(end.run_folder);
  words.push_back(fmt::format("--ui-scale={}", arguments.ui_scale));
  become(words);
}

}  // namespace gelslam
