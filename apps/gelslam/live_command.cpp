#include "live_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <stop_token>
#include <thread>

#include "child_program.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "gelslam/slam/sensor_rig.hpp"
#include "gelslam/slam/session.hpp"
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

  const std::string& warned() const { return warned_; }

  void show(const LiveStatus& s) {
    if (quiet_) return;
    const Clock::time_point now = Clock::now();
    if (!s.warning.empty() && s.warning != warned_ && now >= next_warning_) {
      next_warning_ = now + std::chrono::seconds(
                                5);  // some of them count what they warn of; the last word is said at the end
      if (terminal_) std::cerr << "\r\033[K";
      std::cerr << "warning: " << s.warning << "\n";
      warned_ = s.warning;
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
  std::string last_, warned_;
  Clock::time_point next_warning_;
};

/// Returns the last warning that it said.
std::string wait_in_terminal(const LiveSession& session, bool quiet) {
  StatusLine line(quiet);
  while (session.status().phase != LivePhase::finished) {
    line.show(session.status());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return line.warned();
}

/// `warned`: what was said already.
std::string report_text(const ReconstructSummary& s, const LiveStatus& status, const std::string& warned,
                        bool quiet) {
  std::string text;
  if (!s.warning.empty() && s.warning != warned) text += "warning: " + s.warning + "\n";
  text += reservation_words(reservations(s.completeness, s.uncertainty));
  if (quiet) return text;
  for (const std::string& part : s.parts) text += part + "\n";
  text += fmt::format("{} in {:.1f} s, {} lost by the camera, {} dropped, {} damaged\n",
                      counted(status.frames, "frame"), s.seconds, status.lost_by_camera, status.dropped,
                      status.damaged);
  text += fmt::format("{} tracked, {}\n{}{}\n", s.tracked, map_words(s), mesh_words(s),
                      status.run_folder.empty() ? ", not kept (no -o)" : ": " + status.run_folder);
  return text;
}

}  // namespace

void LiveArguments::add_to(CLI::App& command) {
  CLI::Option* output = command.add_option(
      "-o,--output", run_folder, "Run folder to write: mesh, trajectory, report; with a scan, its log");
  CLI::Option* replace = command.add_flag("--overwrite", overwrite, "Replace the run folder if it is there");
  command
      .add_option(
          "--continue", continued,
          "Run folder to continue in place, also after a crash: new frames join its map (of two sensors: "
          "at the end)")
      ->excludes(output)
      ->excludes(replace);
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

std::string LiveArguments::new_run_folder() const {
  if (continued.empty()) return run_folder;
  const std::filesystem::path run(continued);
  const std::string name = (run.has_filename() ? run : run.parent_path()).string() + "-";
  for (int number = 2;; ++number) {
    const std::string folder = name + std::to_string(number);
    if (!std::filesystem::exists(folder) && !std::filesystem::exists(run_of_sensor(folder, 0)) &&
        !std::filesystem::exists(run_of_sensor(folder, 1)))
      return folder;
  }
}

bool LiveArguments::continues_several(std::initializer_list<Config*> configs) const {
  if (continued.empty() || !is_of_several_sensors(continued)) return false;
  for (Config* config : configs) config->slam.slope_calibration = {};
  return true;
}

LiveOptions LiveArguments::options_in(const std::string& folder, const Config& config) const {
  LiveOptions options;
  options.show_mesh = !headless || !snapshot.empty();
  options.config = config;
  options.background = log.background;
  options.force = log.force;
  options.run_folder = folder;
  options.overwrite = overwrite;
  if (folder == continued && !continued.empty())
    options.continued = continue_in_place(continued, config);
  else if (!continued.empty())
    load_map(std::filesystem::path(continued) /
             "session");  // that it is not finished is said before the scan
  options.stream = stream.open(config.slam.slope_calibration.gradient_scale_sigma, quiet);
  return options;
}

LiveOptions LiveArguments::options(Config config) const {
  const bool in_place = !continued.empty() && !continues_several({&config});
  return options_in(in_place ? continued : new_run_folder(), config);
}

LogInput LiveArguments::input(const std::string& path, std::size_t sensor, std::size_t sensors) const {
  return with_settings_of_run(log.input(path, sensor, sensors), continued);
}

std::array<LiveOptions, 2> LiveArguments::options_of_two(std::array<Config, 2> configs) const {
  const std::string folder = new_run_folder();
  if (folder.empty()) throw Error("two sensors need a run folder: -o RUN");
  if (!log.background.empty())
    throw Error("--background is of one sensor; each of two begins with its bare gel");
  if (!stream.target.empty() && stream.stream_format() == StreamFormat::tum)
    throw Error("--stream-format tum does not tell two sensors apart; use ndjson");
  continues_several({&configs[0], &configs[1]});
  std::array<LiveOptions, 2> both = {options_in(folder, configs[0]), {}};
  both[1] = both[0];
  both[1].config = configs[1];
  if (both[0].stream) both[1].stream = std::make_shared<PoseStream>(*both[0].stream);
  for (int sensor = 0; sensor < 2; ++sensor)
    both[static_cast<std::size_t>(sensor)].run_folder = run_of_sensor(folder, sensor);
  return both;
}

WindowOptions prepare_window(const LiveOptions& options, const LiveArguments& arguments) {
  check_run_folder(options);
  WindowOptions window;
  window.picture_folder = options.run_folder.empty() ? "." : options.run_folder.string();
  window.keeps_run = !options.run_folder.empty();
  window.script = read_script_file(arguments.script);
  window.script_name = arguments.script;
  if (!window.script.empty()) check_window_script(window.script, window.script_name);
  window.snapshot = arguments.snapshot;
  window.ui_scale = arguments.ui_scale;

  if (options.continued) {
    for (const std::string& warning : options.continued->record.warnings)
      std::cerr << "warning: " << warning << "\n";
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
  NextStep next = NextStep::none;
  std::string run_folder;
};

/// A scan that continues a run of several sensors becomes a part of it.
void join_with_continued(const std::filesystem::path& scan, const LiveArguments& arguments) {
  MergeRequest request{{arguments.continued, scan}, arguments.continued};
  request.in_place = true;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const ReconstructSummary all =
      merge_scans(request, *progress, [&] { return interrupt.requested(); }).account.summary;
  std::cerr << run_words(all, arguments.continued, arguments.quiet);
}

template <typename Session, typename... Inputs>
LiveEnd run_to_its_end(const LiveOptions& options, const LiveArguments& arguments, WindowOptions window,
                       Inputs&&... inputs) {
  LiveEnd end;
  // Before there is anything that must not be left behind.
  const InterruptWatch interrupt(
      2, options.log.empty() ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early);
  Session session(std::forward<Inputs>(inputs)...);
  const StopWatch stop_watch(session, interrupt, arguments.seconds);
  if (!arguments.headless) {
    lower_thread_priority();  // drawing goes after tracking; the threads of the chain run already
    window.asks_to_end = [&] { return interrupt.requested(); };
    end.next = run_live_window(session, window);
    session.stop();
  }
  const std::string warned = wait_in_terminal(session, arguments.quiet);
  const ReconstructSummary summary = session.wait();
  if (arguments.headless && !arguments.snapshot.empty())
    write_live_snapshot(session, arguments.snapshot, window);
  std::cerr << report_text(summary, session.status(), warned, arguments.quiet);
  if (options.stream && !options.stream->finish()) std::cout.setstate(std::ios::badbit);  // main() says so
  end.exit_code = summary.tracked == 0 || summary.partial ? kExitNotGood : kExitDone;
  end.run_folder = session.status().run_folder;
  return end;
}

}  // namespace

int run_live(std::unique_ptr<RawFrameSource> source, const LiveOptions& options,
             const LiveArguments& arguments, WindowOptions window, const std::vector<std::string>& go_on) {
  window.can_go_on = !go_on.empty();
  LiveEnd end = run_to_its_end<LiveSlam>(options, arguments, std::move(window), std::move(source), options);
  if (!arguments.continued.empty() && !options.continued) {
    join_with_continued(options.run_folder, arguments);
    end.run_folder = arguments.continued;
  }
  if (end.next == NextStep::none) return end.exit_code;
  std::vector<std::string> words = end.next == NextStep::view ? std::vector<std::string>{"view"} : go_on;
  words.push_back(end.run_folder);
  words.push_back(fmt::format("--ui-scale={}", arguments.ui_scale));
  become(words);
}

int run_live_rig(std::array<LiveRig::Sensor, 2> sensors, const LiveArguments& arguments) {
  LiveRigOptions rig{arguments.new_run_folder(), arguments.overwrite, {}, arguments.continued};
  if (!arguments.rig.empty()) rig.known = read_rig(arguments.rig).pose;
  const LiveOptions first = sensors[0].options;
  const LiveEnd end =
      run_to_its_end<LiveRig>(first, arguments, prepare_window(first, arguments), std::move(sensors), rig);
  if (end.next == NextStep::view)
    become({"view", end.run_folder, fmt::format("--ui-scale={}", arguments.ui_scale)});
  return end.exit_code;
}

}  // namespace gelslam
