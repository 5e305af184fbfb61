#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>

#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/viewer/mesh_picture.hpp"

namespace gelslam {
namespace {

struct ExportArguments {
  std::filesystem::path source, output;
  std::string units = "m";
  bool overwrite = false;
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

void run_export(const ExportArguments& arguments) {
  if (std::filesystem::exists(arguments.output) && !arguments.overwrite) {
    throw Error("'" + arguments.output.string() + "' exists already; use --overwrite to replace it");
  }
  const Mesh mesh = read_mesh(mesh_file(arguments.source));
  if (arguments.output.extension() == ".png") {
    write_picture(arguments.output, draw_mesh(mesh));
    std::cerr << "wrote " << arguments.output.string() << "\n";
    return;
  }
  write_mesh(arguments.output, mesh, arguments.units == "mm" ? LengthUnit::millimetre : LengthUnit::metre);
  std::cerr << "wrote " << arguments.output.string() << ": " << mesh.vertices_mm.size() << " vertices, "
            << mesh.triangles.size() << " triangles, in " << arguments.units << "\n";
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("export", "Write a run's surface as PLY, OBJ or STL, or a picture of it");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("SOURCE", arguments->source, "run folder, or a mesh file (PLY, OBJ, STL) in metres")
      ->required();
  command
      ->add_option("-o,--output", arguments->output,
                   "file to write; its ending (ply, obj, stl; png: a picture from three sides) is its format")
      ->required();
  command->add_option("--units", arguments->units, "unit of the file's numbers")
      ->check(CLI::IsMember({"m", "mm"}))
      ->capture_default_str();
  command->add_flag("--overwrite", arguments->overwrite, "replace the file if it exists");
  command->footer("Example: gelslam export RUN -o object.stl --units mm");
  command->callback([arguments, &exit_code] {
    run_export(*arguments);
    exit_code = exit_done;
  });
}

}  // namespace gelslam
