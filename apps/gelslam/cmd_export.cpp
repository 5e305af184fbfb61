#include <fmt/core.h>

#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/simplify.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "gelslam/exchange/watertight.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  fs::path source, output;
  std::string units, color;
  std::optional<double> max_error_mm;
  bool largest_piece = false, watertight = false, close = false, any_log = false, overwrite = false,
       quiet = false;
};

/// Thrown at Ctrl-C. It is not an Error, because some of the code takes an Error for a damaged log.
struct Stopped {};

std::string ending_of(const fs::path& path) { return lower_case(path.extension().string()); }

/// Returns those given options that not every format accepts, as they are written on the command line.
std::set<std::string> chosen_options(const ExportArguments& a) {
  std::set<std::string> given;
  if (!a.units.empty()) given.insert("--units");
  if (!a.color.empty()) given.insert("--color");
  if (a.max_error_mm) given.insert("--max-error-mm");
  if (a.largest_piece) given.insert("--largest-piece");
  if (a.watertight) given.insert("--watertight");
  if (a.any_log) given.insert("--any-log");
  return given;
}

/// Throws Error for an unknown extension, or an option that it does not accept.
void check_output(const ExportArguments& a) {
  static const std::set<std::string> mesh = {"--max-error-mm", "--largest-piece", "--watertight"};
  static const std::map<std::string, std::set<std::string>> takes = {{".ply", {"--units", "--color"}},
                                                                     {".obj", {"--units"}},
                                                                     {".stl", {"--units"}},
                                                                     {".xyz", {"--units"}},
                                                                     {".glb", {"--color"}},
                                                                     {".mcap", {"--color", "--any-log"}},
                                                                     {".html", {"--color"}},
                                                                     {".tum", {}}};
  const std::string ending = ending_of(a.output);
  const auto found = takes.find(ending);
  if (found == takes.end())
    throw Error("cannot export to " + quoted(a.output) +
                ": the name has to end in .ply, .obj, .stl, .xyz, .glb, .html, .mcap or .tum");
  for (const std::string& option : chosen_options(a))
    if (!found->second.contains(option) && !(ending != ".tum" && mesh.contains(option)))
      throw Error(fmt::format("{} has no meaning for {} files", option, ending));
  check_output_file(a.output, a.overwrite);
}

/// Returns "3 loose pieces: the largest has 97.2 % of the area", or "" for a mesh with a single shell.
std::string describe_shells(const Mesh& mesh) {
  const MeshShells shells = find_shells(mesh);
  if (shells.area_mm2.size() < 2) return "";
  return fmt::format("{} loose pieces: the largest has {:.1f} % of the area", shells.area_mm2.size(),
                     100 * shells.largest_share);
}

/// Checks that the run contains what the format needs: pages and mesh files need a mesh, MCAP files do not.
void check_contents(const ExportArguments& a, const RunContents& run) {
  const std::string ending = ending_of(a.output);
  if (ending == ".mcap" || ending == ".tum") {
    if (run.folder.empty())
      throw Error("cannot make " + ending + " of " + quoted(a.source) + ": it is a mesh; give a run folder");
  } else if (run.mesh.triangles.empty()) {
    throw Error("cannot export " + quoted(a.source) +
                ": it holds no mesh.ply with a surface; give a run folder or a mesh file");
  }
}

/// Applies --watertight and --close. Returns false if the surface stays open.
bool fill_gaps(const ExportArguments& a, RunContents& run, ProgressSink& progress,
               const std::function<void(const std::string&)>& say) {
  WatertightMesh watertight = [&] {
    const InterruptWatch at_once(1, InterruptWatch::Ends::at_once);
    return make_watertight(run.mesh, a.close, progress);
  }();
  run.mesh = std::move(watertight.mesh);
  const std::string words =
      watertight.volume_mm3 > 0
          ? fmt::format("a closed body of {} mm3, {:.0f} % of its surface touched",
                        short_number(watertight.volume_mm3, 4), 100 * watertight.touched_share)
          : fmt::format("gaps up to {} mm wide are filled, the surface is open beyond",
                        short_number(2 * watertight.reach_mm, 2));
  const bool is_closed = watertight.volume_mm3 > 0;
  if (is_closed)
    say("made watertight: " + words);
  else
    warn("not watertight: " + words + " (--close makes a closed body)");
  run.figures.emplace_back("Watertight", is_closed ? words : "no, " + words);
  return is_closed;
}

/// Applies --largest-piece, --watertight and --max-error-mm. `say` is called with descriptions of the result.
/// Returns false if the mesh should be watertight and is not.
bool reduce_mesh(const ExportArguments& a, RunContents& run, ProgressSink& progress,
                 const std::function<void(const std::string&)>& say) {
  if (run.mesh.triangles.empty()) return true;
  if (a.largest_piece) {
    const std::string shells = describe_shells(run.mesh);
    if (!shells.empty()) say(shells + "; it alone is exported");
    run.mesh = largest_shell(run.mesh);
  }
  const bool as_asked = !a.watertight || fill_gaps(a, run, progress, say);
  if (!a.max_error_mm) return as_asked;
  const std::size_t before = run.mesh.triangles.size();
  progress.begin("simplifying", std::nullopt);
  SimplifiedMesh simplified = simplify(run.mesh, *a.max_error_mm);
  progress.end();
  run.mesh = std::move(simplified.mesh);
  const std::string words = fmt::format("{} of {} triangles, error {} mm", run.mesh.triangles.size(), before,
                                        short_number(simplified.error_mm, 3));
  say("simplified to " + words);
  run.figures.emplace_back("Simplified", words);
  return as_asked;
}

MeshColor color_of(const ExportArguments& a, const RunContents& run, const std::string& ending) {
  static const std::map<std::string, MeshColor> colors = {
      {"none", MeshColor::none}, {"confidence", MeshColor::confidence}, {"height", MeshColor::height}};
  if (!a.color.empty()) return colors.at(a.color);
  const bool is_colored = ending == ".glb" || (ending == ".mcap" && !run.mesh.triangles.empty());
  return is_colored ? MeshColor::height : MeshColor::none;
}

LengthUnit output_unit(const ExportArguments& a) {
  if (a.units.empty()) return usual_unit(a.output);
  return a.units == "mm" ? LengthUnit::millimeter : LengthUnit::meter;
}

/// Writes the file and returns a description of its contents.
std::string write_output(const ExportArguments& a, const RunContents& run, ProgressSink& progress) {
  const std::string ending = ending_of(a.output);
  const MeshColor color = color_of(a, run, ending);
  const VertexColors colors = vertex_colors(run.mesh, color);
  if (ending == ".tum") {
    write_file_atomically(a.output, tum_text(run.trajectory));
    return counted(static_cast<std::int64_t>(run.trajectory.size()), "pose") + ", in m";
  }
  if (ending == ".mcap") {
    const McapOutcome outcome = write_mcap(a.output, run, colors, progress);
    if (!outcome.missing.empty())
      print_line((outcome.pictures > 0 ? "not all pictures: " : "no pictures: ") + outcome.missing);
    if (run.mesh.triangles.empty()) std::cerr << "no mesh: the run has none\n";
    return counted(outcome.poses, "pose") + ", " + counted(outcome.pictures, "picture") + ", in m" +
           (run.start_s() > 0 ? "" : ", times from 0: the log does not say when it was recorded");
  }
  progress.begin("writing", std::nullopt);
  if (ending == ".html") {
    write_page(a.output, run, color);
  } else {
    write_mesh(a.output, run.mesh, output_unit(a), colors);
  }
  progress.end();
  const std::string faces = ending == ".xyz" ? "" : fmt::format(", {} triangles", run.mesh.triangles.size());
  return fmt::format("{} vertices{}, in {}", run.mesh.vertices_mm.size(), faces, short_name(output_unit(a)));
}

int export_run(const ExportArguments& a) {
  check_output(a);
  const auto say = [&](const std::string& sentence) {
    if (!a.quiet) print_line(sentence);
  };
  StoppableProgress progress(a.quiet, [] { throw Stopped{}; });
  progress.begin("reading the mesh", std::nullopt);
  RunContents run = read_run_contents(a.source);
  run.takes_any_log = a.any_log;
  progress.end();
  if (!a.quiet) say_mesh_unit(a.source);
  check_contents(a, run);
  const bool as_asked = reduce_mesh(a, run, progress, say);
  const std::string words = write_output(a, run, progress);
  say("wrote " + a.output.string() + ": " + words);
  if (const std::string shells = describe_shells(run.mesh); !a.quiet && !shells.empty())
    std::cerr << shells << "\n";
  if (!a.quiet && !run.folder.empty()) print_run_warnings(run.folder);
  return as_asked ? kExitDone : kExitNotGood;
}

void add_options(CLI::App& command, ExportArguments& a) {
  command.add_option("SOURCE", a.source, "Run folder, or a mesh file (PLY, OBJ, STL)")->required();
  command
      .add_option("-o,--output", a.output,
                  "File to write; its ending is its format: ply, obj, stl or glb (the surface), xyz (its "
                  "points), html (a page to "
                  "turn it around), mcap (the run for Foxglove), tum (the trajectory)")
      ->required();
  command
      .add_option(
          "--color", a.color,
          "Vertex colors (default: height in GLB and MCAP, none in PLY); in a page, what it shows first")
      ->check(CLI::IsMember({"none", "confidence", "height"}));
  command.add_flag("--largest-piece", a.largest_piece, "Leave out all loose pieces but the largest");
  CLI::Option* watertight = command.add_flag("--watertight", a.watertight,
                                             "Fill gaps of a few edges of the mesh (it says how wide); where "
                                             "more was not touched, the surface stays open (exit code 1)");
  command
      .add_flag("--close", a.close,
                "With --watertight: a closed body, for printers and simulators; where nothing was touched it "
                "goes on smoothly or, if it then stays open, along the convex hull, with a back a tenth of "
                "its size behind what was touched from one side")
      ->needs(watertight);
  command
      .add_option(
          "--max-error-mm", a.max_error_mm,
          "Simplify while the error, an estimate of the distance from the full surface, stays within this")
      ->check(number_between(1e-5, 100.0));
  command
      .add_option("--unit,--units", a.units,
                  "Unit of the PLY, OBJ, STL or XYZ written (default: m for PLY, mm for the others)")
      ->check(CLI::IsMember({"m", "mm"}));
  command.add_flag("--any-log", a.any_log,
                   "Pictures (mcap) also of logs that are not in the folder that holds the run");
  add_overwrite_flag(command, a.overwrite);
  add_quiet_flag(command, a.quiet);
}

int run_export(const ExportArguments& a) {
  try {
    return export_run(a);
  } catch (const Stopped&) {
    throw Error("stopped: the file is not written");
  }
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("export", "Write a run for other programs: mesh, web page, MCAP, or trajectory");
  auto& arguments = options_of(*command, exit_code, run_export);
  add_options(*command, arguments);
  command->footer(
      "Example: gelslam export RUN -o object.stl\n"
      "Example: gelslam export RUN -o body.stl --watertight --close\n"
      "Example: gelslam export RUN -o object.html --max-error-mm 0.01\n"
      "Example: gelslam export RUN -o run.mcap");
}

}  // namespace gelslam
