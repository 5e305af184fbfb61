#include <fmt/core.h>

#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/config.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct MapArguments {
  std::filesystem::path mesh, output, config;
  MeshUnit unit;
  MeshMapOptions options;
  bool overwrite = false, quiet = false;
};

int run_map(const MapArguments& arguments) {
  MeshMapOptions options = arguments.options;
  options.camera = configured_camera(find_config({{}, arguments.config, {}, {}, false}));
  RunFolder folder(arguments.output, map_folder_options(arguments.mesh, arguments.overwrite));
  const Mesh mesh = read_mesh(arguments.mesh, arguments.unit.mm(arguments.mesh));
  StoppableProgress progress(arguments.quiet, [] { throw Error("stopped; nothing was written"); });
  const MeshMap map = make_mesh_map(mesh, options, progress);
  write_map(folder.path(), map, mesh, std::filesystem::absolute(arguments.mesh).string());
  folder.commit();
  if (!map.warning.empty()) std::cerr << "warning: " << map.warning << "\n";
  if (!arguments.quiet) {
    arguments.unit.say(arguments.mesh);
    std::cerr << fmt::format("{}, {:.0f} % of the surface covered: {}\n",
                             counted(static_cast<std::int64_t>(map.patches.size()), "touch"),
                             100 * map.covered_share, arguments.output.string());
  }
  return map.warning.empty() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "map", "Make a map for localization from a mesh of an object that was never touched");
  const auto a = std::make_shared<MapArguments>();
  command->add_option("MESH", a->mesh, "Closed mesh of the object (STL, OBJ or PLY)")->required();
  a->unit.add_to(*command);
  command->add_option("-o,--output", a->output, "Map folder to write")->required();
  add_overwrite_flag(*command, a->overwrite);
  command->add_option("--config", a->config,
                      "Configuration of the sensor: picture size, pixel pitch and optics");
  command
      ->add_option("--indentation", a->options.indentation_mm, "How deep the sensor will be pressed on, mm")
      ->check(number_between(0.05, 1.5))
      ->capture_default_str();
  command
      ->add_option("--touches", a->options.max_touches,
                   "Most touches to simulate, about 0.1 s each on one core")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  add_quiet_flag(*command, a->quiet);
  command->footer(
      "Example: gelslam map part.stl -o part_map\n"
      "         gelslam track --camera --model nnmodel.pth --map part_map --format ndjson");
  command->callback([a, &exit_code] { exit_code = run_map(*a); });
}

}  // namespace gelslam
