#include <fmt/core.h>

#include <optional>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/config.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct MapArguments {
  std::filesystem::path mesh, output, config;
  std::string unit;
  MeshMapOptions options;
  bool overwrite = false, quiet = false;
};

/// Prints the unit in which a mesh was read if it is not obvious. `given` is the value of --unit, or "".
void say_unit(const std::filesystem::path& mesh, const std::string& given) {
  if (given.empty()) return say_mesh_unit(mesh);
  const std::optional<LengthUnit> noted = noted_unit(mesh);
  print_line("unit of " + mesh.string() + ": " +
             (noted ? short_name(*noted) + std::string(", as the file notes") : given));
}

int run_map(const MapArguments& arguments) {
  MeshMapOptions options = arguments.options;
  options.camera = configured_camera(find_config({.config = arguments.config}));
  RunFolder folder(arguments.output, map_folder_options(arguments.mesh, arguments.overwrite));
  const Mesh mesh = read_mesh(arguments.mesh, named_unit_mm(arguments.mesh, arguments.unit));
  StoppableProgress progress(arguments.quiet);
  const MeshMap map = make_mesh_map(mesh, options, progress);
  write_map(folder.path(), map, mesh, std::filesystem::absolute(arguments.mesh).string());
  folder.commit();
  if (!map.warning.empty()) print_line("warning: " + map.warning);
  if (!arguments.quiet) {
    say_unit(arguments.mesh, arguments.unit);
    print_line(fmt::format("{}, {:.0f} % of the surface covered: {}",
                           counted(static_cast<std::int64_t>(map.patches.size()), "touch"),
                           100 * map.covered_share, arguments.output.string()));
  }
  return map.warning.empty() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "map", "Make a map for localization from a mesh of an object that was never touched");
  auto& a = options_of(*command, exit_code, run_map);
  command->add_option("MESH", a.mesh, "Closed mesh of the object (STL, OBJ or PLY)")->required();
  command
      ->add_option("--unit,--units", a.unit,
                   "Unit of a mesh file that notes none (default: mm for STL and OBJ, m for PLY)")
      ->check(CLI::IsMember({"mm", "cm", "in", "m"}));
  command->add_option("-o,--output", a.output, "Map folder to write")->required();
  add_overwrite_flag(*command, a.overwrite);
  command->add_option("--config", a.config,
                      "Configuration of the sensor: picture size, pixel pitch and optics");
  command
      ->add_option("--touches", a.options.max_touches,
                   "Most touches to simulate, about 0.1 s each on one core")
      ->transform(whole_number(1, 100'000))
      ->capture_default_str();
  add_quiet_flag(*command, a.quiet);
  command->footer(
      "Example: gelslam map part.stl -o part_map\n"
      "         gelslam track --camera --model nnmodel.pth --map part_map --format ndjson");
}

}  // namespace gelslam
