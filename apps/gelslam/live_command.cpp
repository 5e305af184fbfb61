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

#include "commands.hpp"
#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/viewer/window.hpp"
#include "gelslam/viewer/window_host.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;

/// Forwards requests to end from outside the window: Ctrl-C, once or twice, and --seconds.
std::jthread pass_on_stops(LiveSession& session, const InterruptWatch& interrupt, double seconds) {
  return std::jthread([&session, &interrupt, seconds](const std::stop_token& token) {
    const Clock::time_point start = Clock::now();
    bool stopped = false;
    while (!token.stop_requested()) {
      const bool time_is_up =
          seconds > 0 && std::chrono::duration<double>(Clock::now() - start).count() > seconds;
      if (!std::exchange(stopped, stopped || interrupt.requested() || time_is_up) && stopped) session.stop();
      if (interrupt.requests() > 1) return session.abort();
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
  });
}

/// The status in the terminal: a line that is overwritten or, if stderr is no terminal, a new line for every
/// change of state.
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
      // Some warnings contain a count; only the last one of these is printed at the end.
      std::string kind = warning;
      std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
      if (!kinds_.insert(std::move(kind)).second) continue;
      if (terminal_) std::cerr << "\r\033[K";
      warn(warning);
      warned_.push_back(warning);
    }
    const std::string progress = s.progress.empty() ? "" : ": " + s.progress;
    const std::string line = state_line(s) + (terminal_ ? progress + figures(s) : "");
    if (line == last_ || line.empty()) return;
    std::cerr << (terminal_ ? "\r\033[K" : "") << line << (terminal_ ? "" : "\n") << std::flush;
    last_ = line;
  }

 private:
  static std::string figures(const LiveStatus& s) {
    std::string text = fmt::format(" | {:.1f} Hz, {:.1f} ms (99 %: {:.1f} ms) | {}, {}, {}", s.rate_hz,
                                   s.latency_ms, s.latency_p99_ms, counted(s.keyframes, "keyframe"),
                                   counted(s.loops, "loop"), counted(s.components, "component"));
    if (s.lost_by_camera + s.dropped + s.damaged > 0)
      text += fmt::format(" | {} lost, {} dropped, {} damaged", s.lost_by_camera, s.dropped, s.damaged);
    return text;
  }

  const bool quiet_, terminal_;
  std::string last_;
  std::vector<std::string> warned_;
  std::set<std::string> kinds_;
};

/// Returns the warnings that were printed.
std::vector<std::string> wait_in_terminal(const LiveSession& session, bool quiet) {
  StatusLine line(quiet);
  while (session.status().phase != LivePhase::finished) {
    line.show(session.status());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return line.warned();
}

/// `warned` are the warnings that were already printed.
std::string report_text(RunReport r, const LiveStatus& status, const std::vector<std::string>& warned,
                        bool quiet) {
  for (const std::string& said : warned) std::erase(r.warnings, said);
  std::string text = warning_words(r.warnings) + warning_words(r.result_warnings);
  if (quiet) return text;
  for (const std::string& part : r.parts) text += one_line(part) + "\n";
  text += fmt::format("{} in {:.1f} s, {} lost by the camera, {} dropped, {} damaged\n",
                      counted(status.frames, "frame"), r.seconds, status.lost_by_camera, status.dropped,
                      status.damaged);
  text += fmt::format("{} tracked, {}\n{}{}{}\n", r.frames.tracked, map_words(r), touched_line(r.touched),
                      mesh_words(r.mesh),
                      status.run_folder.empty() ? ", not kept (no -o)" : ": " + one_line(status.run_folder));
  return text;
}

/// Returns RUN-2, RUN-3, ...: the first folder that does not exist and is not about to be created (`now`).
std::filesystem::path next_run_folder(const std::filesystem::path& folder, const std::filesystem::path& now) {
  const std::filesystem::path clean = folder.has_filename() ? folder : folder.parent_path();
  for (int number = 2;; ++number) {
    std::filesystem::path next = clean;
    next += "-" + std::to_string(number);
    std::error_code code;
    if (next != now && !std::filesystem::exists(next, code)) return next;
  }
}

}  // namespace

void LiveArguments::add_to(CLI::App& command) {
  CLI::Option* output = command.add_option(
      "-o,--output", run_folder, "Run folder to write: mesh, trajectory, report; with a scan, its log");
  add_overwrite_flag(command, overwrite);
  command
      .add_option("--continue", continued,
                  "Run folder to continue in place, also after a crash: new frames join its map")
      ->excludes(output)
      ->excludes("--overwrite");
  log.add_to(command);
  command.add_option("--seconds", seconds, "Stop after this many seconds")->check(number_between(0.01, 1e6));
  command.add_flag("--headless", headless, "No window: the state is printed in the terminal");
  command.add_option("--snapshot", snapshot, "Picture of the window at the end (PNG; also with --headless)")
      ->check(refuse_unless_png);
  stream.add_to(command);
  stream.add_live_to(command);
  add_quiet_flag(command, quiet);
}

Config LiveArguments::config(const std::string& source) const {
  return resolve_config(with_settings_of_run(log.input(source), continued));
}

LiveOptions LiveArguments::options(const Config& config) const {
  LiveOptions options;
  options.config = config;
  options.background = log.background;
  options.force = log.force;
  options.background_frames = log.named_frames();
  options.overwrite = overwrite;
  options.keep_free_bytes = keep_free_bytes;
  options.run_folder = continued.empty() ? run_folder : continued;
  if (!continued.empty()) options.continued = continue_in_place(continued, config);
  stream.check();
  if (!stream.target.empty() || !stream.serve.address.empty()) options.stream = std::make_shared<LineFeed>();
  if (!headless || !snapshot.empty() || !stream.serve.address.empty())
    options.mesh_feed = std::make_shared<MeshFeed>();
  return options;
}

namespace {

/// Returns the window's options. Throws Error when a session with these options could not begin, because of
/// the run folder or the display. Creates nothing, so that no camera is opened in vain.
WindowOptions prepare_window(const LiveOptions& options, const LiveArguments& arguments) {
  check_run_folder(options);
  if (std::filesystem::exists(arguments.snapshot)) check_output_file(arguments.snapshot, arguments.overwrite);
  WindowOptions window;
  window.picture_folder = options.run_folder.empty() ? "." : options.run_folder.string();
  window.keeps_run = !options.run_folder.empty();
  window.snapshot = arguments.snapshot;
  if (options.continued && !arguments.quiet)
    print_line(fmt::format("continuing {}: {}", options.run_folder.string(),
                           counted(std::ssize(options.continued->record.keyframes), "keyframe")));
  if (!arguments.headless) viewer::require_display();
  return window;
}

/// Other programs and browsers that receive the stream.
struct Listeners {
  Listeners(const LiveOptions& options, const StreamArguments& arguments, bool quiet)
      : stream(options.stream), mesh(options.mesh_feed) {
    if (!stream) return;
    service = open_service(arguments.serve, *stream, mesh.get(), quiet);
    if (!arguments.target.empty())
      output = std::make_unique<LineOutput>(
          *stream, StreamOptions{arguments.is_tum(), arguments.surface, arguments.images});
  }

  void start_scan() {
    if (stream) stream->start_scan();
    if (mesh) mesh->add(true, {});
  }
  void finish() {
    if (output && !output->finish()) std::cout.setstate(std::ios::badbit);  // main() reports it.
    if (stream) stream->close();
    if (service) service->finish();
  }

  const std::shared_ptr<LineFeed> stream;
  const std::shared_ptr<MeshFeed> mesh;
  std::unique_ptr<HttpService> service;
  std::unique_ptr<LineOutput> output;
};

/// `another` says whether there is a camera for another scan. A request for one is stored in
/// `wants_new_scan`.
WatchedScan watched(LiveSession& session, bool another, std::atomic<bool>& wants_new_scan) {
  WatchedScan scan;
  scan.status = [&session] { return session.status(); };
  scan.touch = [&session] { return session.touch(); };
  scan.map = [&session] { return session.map(); };
  scan.ask = [&](ScanCommand command) {
    if (command == ScanCommand::new_scan) wants_new_scan = true;
    session.stop();
  };
  scan.another = another;
  return scan;
}

struct LiveEnd {
  int exit_code = kExitDone;
  bool wants_new_scan = false;
  BackgroundFrames background;
};

/// Runs work on a thread that was started before drawing lowered its priority, because threads inherit it. An
/// existing window (may be null) handles its events meanwhile.
class UsualPriority {
 public:
  ~UsualPriority() { work_.close(); }

  template <typename Work>
  auto run(Work work, viewer::WindowHost* window) {
    std::packaged_task<decltype(work())()> task(std::move(work));
    auto result = task.get_future();
    work_.push([&task] { task(); });
    while (result.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
      if (window != nullptr) window->wait(0);
    return result.get();
  }

 private:
  BoundedQueue<std::function<void()>> work_{1};
  std::jthread thread_{[this] {
    while (const auto work = work_.pop()) (*work)();
  }};
};

LiveEnd run_to_its_end(std::unique_ptr<RawFrameSource> source, LiveOptions options,
                       const LiveArguments& arguments, WindowOptions& window, HttpService* service,
                       UsualPriority& usual_priority, const InterruptWatch& interrupt) {
  LiveEnd end;
  std::atomic<bool> shown{arguments.headless};
  options.begins = [&shown] { return shown.load(); };
  const auto session =
      usual_priority.run([&] { return begin_live_scan(std::move(source), options); }, window.host.get());
  window.when_shown = [&] { shown = true; };
  const std::jthread stops = pass_on_stops(*session, interrupt, arguments.seconds);
  std::atomic<bool> wants_new_scan{false};
  std::shared_ptr<void> watch;
  if (service) watch = service->watch(watched(*session, options.log.empty(), wants_new_scan));
  const auto finish = [&] {
    const std::vector<std::string> warned = wait_in_terminal(*session, arguments.quiet);
    const RunReport report = session->wait();
    std::cerr << report_text(report, session->status(), warned, arguments.quiet);
    return report.good() && !report.partial ? kExitDone : kExitNotGood;
  };
  if (!arguments.headless) {
    window.asks_to_end = [&] { return interrupt.requested() || wants_new_scan; };
    viewer::before_display_loss_ends_it([&] {
      warn("the display is gone: the scan ends, and is saved");
      session->stop();
      std::_Exit(finish());
    });
    // Kept for the next scan.
    if (!window.host) window.host = std::make_shared<viewer::WindowHost>(window);
    end.wants_new_scan = run_live_window(*session, window);
    viewer::before_display_loss_ends_it({});
    session->stop();
  }
  end.exit_code = finish();
  if (arguments.headless && !arguments.snapshot.empty())
    write_live_snapshot(*session, arguments.snapshot, window);
  end.background = session->background_frames();
  end.wants_new_scan = (end.wants_new_scan || wants_new_scan) && !interrupt.requested();
  return end;
}

}  // namespace

int run_live(LiveOptions options, const LiveArguments& arguments, const std::function<CameraInput()>& open) {
  const std::filesystem::path first = options.run_folder;
  WindowOptions window = prepare_window(options, arguments);
  Listeners listeners(options, arguments.stream, arguments.quiet);
  // Created before there is anything that must not be left behind, and kept between two scans.
  const InterruptWatch interrupt(
      2, options.log.empty() ? InterruptWatch::Ends::regularly : InterruptWatch::Ends::early);
  CameraInput input = open();
  UsualPriority usual_priority;
  if (!arguments.headless) lower_thread_priority();  // Tracking has priority over drawing.
  int exit_code = kExitDone;
  for (;;) {  // Each iteration is one scan, as long as the user begins another one.
    const std::filesystem::path next_folder =
        options.log.empty() ? next_run_folder(first, options.run_folder) : "";
    window.next_run_folder = next_folder.string();
    options.record = input.attachments;
    LiveEnd end = run_to_its_end(std::move(input.frames), options, arguments, window, listeners.service.get(),
                                 usual_priority, interrupt);
    exit_code = std::max(exit_code, end.exit_code);
    if (!end.wants_new_scan) break;
    input = usual_priority.run(open, window.host.get());
    if (interrupt.requested()) break;  // Checked before the next scan has a folder.
    input.frames = after_background(std::move(end.background), std::move(input.frames));
    window.picture_folder = options.run_folder = next_folder;
    options.overwrite = false;
    options.continued.reset();
    listeners.start_scan();
  }
  listeners.finish();
  return exit_code;
}

int run_live_log(const std::string& log, const LiveArguments& arguments, bool every_frame) {
  const Config config = arguments.config(log);
  LiveOptions options = arguments.options(config);
  options.log = log;
  options.drop_when_behind = !every_frame;
  return run_live(std::move(options), arguments, [&]() -> CameraInput {
    // A log of another camera must be refused before a run folder is created or replaced.
    open_frame_source(log, config.sensor)->next();
    return {pace(open_raw_log(log, config.sensor), every_frame ? Pace::as_taken : Pace::as_recorded)};
  });
}

}  // namespace gelslam
