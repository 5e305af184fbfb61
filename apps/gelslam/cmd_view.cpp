#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/viewer/view_window.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ViewArguments {
  std::filesystem::path source, compare, truth, snapshot;
  std::string size = "1280x800", color, shading = "clay";
  std::optional<double> time_s;
  bool trajectory = false, graph = false, missing = false, overwrite = false, quiet = false;
};

/// Parses width and height: "1280x800". Throws Error.
std::pair<int, int> parse_size(const std::string& text) {
  const auto size = two_numbers(text, 'x');
  if (!size || std::min(size->first, size->second) < 16 || std::max(size->first, size->second) > 8192)
    throw Error("--size " + text + ": give width and height in pixels, 16 to 8192, as 1280x800");
  return *size;
}

SceneStyle style_of(const ViewArguments& arguments) {
  static const std::map<std::string, SceneColor> colors = {{"plain", SceneColor::plain},
                                                           {"confidence", SceneColor::confidence},
                                                           {"height", SceneColor::height},
                                                           {"distance", SceneColor::distance}};
  SceneStyle style;
  if (arguments.shading == "curvature") style.shading = SceneShading::curvature;
  const bool has_second = !arguments.compare.empty() || !arguments.truth.empty();
  style.color = has_second ? SceneColor::distance : SceneColor::plain;
  if (!arguments.color.empty()) style.color = colors.at(arguments.color);
  style.trajectory = arguments.trajectory;
  style.keyframes = style.edges = arguments.graph;
  style.not_in_mesh = arguments.missing;
  return style;
}

std::optional<ViewContent> second_surface(const ViewArguments& arguments) {
  if (!arguments.truth.empty()) return load_truth(arguments.truth, arguments.source);
  if (!arguments.compare.empty()) return load_view(arguments.compare);
  return std::nullopt;
}

/// Checks what can be wrong before a window is opened. Throws Error.
void check(const ViewArguments& arguments, const ViewContent& content, const SceneStyle& style) {
  if (!std::isfinite(arguments.time_s.value_or(0))) throw Error("--time needs a number");
  const bool has_second = !arguments.compare.empty() || !arguments.truth.empty();
  if (style.color == SceneColor::distance && !has_second) {
    throw Error("--color distance needs a second surface: give --compare or --truth");
  }
  if (content.history) return;
  if (arguments.time_s || arguments.missing)
    throw Error("--time and --missing need a run folder with its session");
}

int run_view(const ViewArguments& arguments) {
  check_output_file(arguments.snapshot, arguments.overwrite);
  ViewWindowOptions options;
  std::tie(options.width_px, options.height_px) = parse_size(arguments.size);
  options.style = style_of(arguments);
  options.time_s = arguments.time_s;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  progress->begin("reading", std::nullopt);
  ViewContent content = load_view(arguments.source);
  std::optional<ViewContent> second = second_surface(arguments);
  progress->end();
  check(arguments, content, options.style);
  if (!arguments.quiet)
    for (const std::filesystem::path& shown : {arguments.source, arguments.compare, arguments.truth})
      say_mesh_unit(shown);
  if (!arguments.quiet) print_run_warnings(arguments.source);
  if (arguments.snapshot.empty()) {
    options.title = content.name + " - GelSLAM";
    run_view_window(std::move(content), std::move(second), options);
    return kExitDone;
  }
  progress->begin("drawing", std::nullopt);
  write_view_snapshot(std::move(content), std::move(second), options, arguments.snapshot);
  progress->end();
  if (!arguments.quiet) print_line("wrote " + arguments.snapshot.string());
  return kExitDone;
}

}  // namespace

void add_view_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("view", "Look at a run or a mesh");
  auto& a = options_of(*command, exit_code, run_view);
  command->add_option("SOURCE", a.source, "Run folder, or a mesh file (PLY, OBJ, STL)")->required();
  auto* compare =
      command->add_option("--compare", a.compare, "Run folder or mesh in the same frame, shown beside it");
  command
      ->add_option("--truth", a.truth,
                   "Data folder of the run's log, or a mesh in the same frame: the true surface")
      ->excludes(compare);
  command
      ->add_option("--snapshot", a.snapshot,
                   "Write a picture (PNG) instead of opening a window; needs no display")
      ->check(refuse_unless_png);
  command->add_option("--size", a.size, "Size of the window or picture in pixels")->capture_default_str();
  command->add_option("--shading", a.shading, "Shading of the surface")
      ->check(CLI::IsMember({"clay", "curvature"}))
      ->capture_default_str();
  command
      ->add_option("--color", a.color, "What colors show (default: plain; with a second surface: distance)")
      ->check(CLI::IsMember({"plain", "confidence", "height", "distance"}));
  command->add_option("--time", a.time_s, "Show touch, keyframes and trajectory of this second of the log");
  command->add_flag("--trajectory", a.trajectory, "Show the sensor's trajectory");
  command->add_flag("--graph", a.graph, "Show keyframes and the edges between them");
  command->add_flag("--missing", a.missing, "Show, in blue, what was touched and is not in the mesh");
  add_overwrite_flag(*command, a.overwrite);
  add_quiet_flag(*command, a.quiet);
  command->footer("Example: gelslam view RUN\nExample: gelslam view RUN --truth DATA --snapshot view.png");
}

}  // namespace gelslam
