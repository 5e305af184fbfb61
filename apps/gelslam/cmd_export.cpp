#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <system_error>
#include <vector>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/map_completeness.hpp"
#include "gelslam/viewer/mesh_picture.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ExportArguments {
  std::filesystem::path source, output;
  std::string units;
  bool overwrite = false, quiet = false;
};

std::filesystem::path mesh_file(const std::filesystem::path& source) {
  std::error_code code;
  if (!std::filesystem::exists(source, code)) throw Error(source.string() + ": no such file or folder");
  if (!std::filesystem::is_directory(source)) return source;
  const std::filesystem::path mesh = source / "mesh.ply";
  if (!std::filesystem::exists(mesh)) {
    throw Error("cannot export '" + source.string() +
                "': it holds no mesh.ply; give a run folder or a mesh file");
  }
  return mesh;
}

/// "3 loose pieces: the largest has 97.2 % of the area"; "" for a mesh in one piece.
std::string loose_pieces(const Mesh& mesh) {
  std::vector<std::size_t> parent(mesh.vertices_mm.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](int vertex) {
    auto v = static_cast<std::size_t>(vertex);
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (const int corner : {t[1], t[2]}) parent[root(corner)] = root(t[0]);
  std::map<std::size_t, double> area;
  double total = 0, largest = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto& v = mesh.vertices_mm;
    const auto corner = [&](int k) { return v[static_cast<std::size_t>(t[k])]; };
    const double twice = static_cast<double>((corner(1) - corner(0)).cross(corner(2) - corner(0)).norm());
    total += twice;
    largest = std::max(largest, area[root(t[0])] += twice);
  }
  if (area.size() < 2) return "";
  return fmt::format("{} loose pieces: the largest has {:.1f} % of the area", area.size(),
                     total > 0 ? 100 * largest / total : 0.0);
}

LengthUnit unit_of(const ExportArguments& arguments) {
  if (arguments.units.empty()) return usual_unit(arguments.output);
  return arguments.units == "mm" ? LengthUnit::millimetre : LengthUnit::metre;
}

void say_what_is_missing(const ExportArguments& arguments, const Mesh& mesh) {
  const std::string pieces = loose_pieces(mesh);
  if (!pieces.empty()) std::cerr << pieces << "\n";
  if (!std::filesystem::is_directory(arguments.source)) return;
  const auto completeness = read_completeness(arguments.source);
  if (completeness && !completeness->complete()) std::cerr << describe(*completeness) << "\n";
}

void run_export(const ExportArguments& arguments) {
  if (std::filesystem::exists(arguments.output) && !arguments.overwrite) {
    throw Error("'" + arguments.output.string() + "' exists already; use --overwrite to replace it");
  }
  const auto progress = make_progress(arguments.quiet);
  progress->begin("reading the mesh", std::nullopt);
  const Mesh mesh = read_mesh(mesh_file(arguments.source));
  const bool picture = lower_case(arguments.output.extension().string()) == ".png";
  progress->begin(picture ? "drawing" : "writing", std::nullopt);
  if (picture) {
    write_picture(arguments.output, draw_mesh(mesh));
  } else {
    write_mesh(arguments.output, mesh, unit_of(arguments));
  }
  progress->end();
  if (arguments.quiet) return;
  std::cerr << "wrote " << arguments.output.string();
  if (!picture)
    std::cerr << fmt::format(": {} vertices, {} triangles, in {}", mesh.vertices_mm.size(),
                             mesh.triangles.size(), short_name(unit_of(arguments)));
  std::cerr << "\n";
  say_what_is_missing(arguments, mesh);
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("export", "Write a run's surface as PLY, OBJ or STL, or a picture of it");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("SOURCE", arguments->source, "Run folder, or a mesh file (PLY, OBJ, STL)")->required();
  command
      ->add_option(
          "-o,--output", arguments->output,
          "File to write; its ending is its format: ply, obj, stl, or png (a picture from three sides)")
      ->required();
  command
      ->add_option("--units", arguments->units,
                   "Unit of the file's numbers (default: mm for OBJ and STL, m for PLY)")
      ->check(CLI::IsMember({"m", "mm"}));
  command->add_flag("--overwrite", arguments->overwrite, "Replace the file if it exists");
  add_quiet_flag(*command, arguments->quiet);
  command->footer("Example: gelslam export RUN -o object.stl");
  command->callback([arguments, &exit_code] {
    run_export(*arguments);
    exit_code = exit_done;
  });
}

}  // namespace gelslam
