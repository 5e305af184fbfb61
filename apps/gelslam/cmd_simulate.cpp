#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <memory>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct SimulateArguments {
  ScanSpec scan;
  PressLogSpec press_log;
  DataFolderOptions folder;
  std::filesystem::path output;
  std::string optics = "mini";
  std::uint64_t seed = 1;
  bool list = false, quiet = false, overwrite = false;
};

void print_catalog(const std::string& title, const std::vector<CatalogEntry>& entries) {
  std::cout << title << "\n";
  for (const CatalogEntry& entry : entries)
    std::cout << "  " << std::left << std::setw(12) << entry.name << entry.description << "\n";
}

/// Returns the options of the output folder. `truth` is the file, with the given text, by which a folder is
/// recognized as simulated. If the object is a mesh file, it must not be overwritten.
RunFolderOptions folder_options(const SimulateArguments& arguments, const char* truth, const char* text) {
  const std::filesystem::path object = arguments.scan.object.name;
  return {.overwrite = arguments.overwrite,
          .marker_file = truth,
          .marker_text = text,
          .known_entries = {"gelsight.avi", "config.yaml", "meta.json", "gt_mesh.ply", "touched.npy",
                            "true_start_T_currs.npy", "true_heights.npy", "true_contacts.npy",
                            "contact/*.png", "touches.csv", "model.json", "optics.yaml"},
          .inputs = {object.has_extension() ? object : ""}};
}

SensorOptics optics_of(const std::string& name) {
  if (name == "mini") return kGelSightMiniOptics;
  if (name == "flat") return {};
  return read_optics(name);
}

/// Sets the same sensor for scans and presses, and one seed for everything.
void prepare(SimulateArguments& arguments) {
  arguments.scan.object.seed = arguments.scan.motion.seed = arguments.scan.optics.seed = arguments.seed;
  arguments.press_log.seed = arguments.seed;
  arguments.press_log.optics = arguments.scan.optics;
  arguments.press_log.geometry.optics = arguments.scan.geometry.optics = optics_of(arguments.optics);
}

/// Writes the gradient model that exists for the optics into the folder and returns its path; returns an
/// empty path for other optics.
std::filesystem::path model_of(const SimulateArguments& arguments, const std::filesystem::path& folder) {
  if (arguments.optics != "mini" && arguments.optics != "flat") return {};
  write_file_atomically(folder / "model.json",
                        arguments.optics == "mini" ? mini_model_file() : flat_model_file());
  return folder / "model.json";
}

void run_scan(SimulateArguments& arguments) {
  prepare(arguments);
  StoppableProgress progress(arguments.quiet);
  RunFolder folder(arguments.output, folder_options(arguments, "meta.json", "contact_start_frame"));
  arguments.folder.name = name_of(folder.final_path());
  // Created first, because it checks whether object and motion exist.
  const Simulator simulator(arguments.scan);
  if (!arguments.quiet) say_mesh_unit(arguments.scan.object.name);
  arguments.folder.model = model_of(arguments, folder.path());
  write_data_folder(folder.path(), simulator, arguments.folder, progress);
  folder.commit();
}

void add_common_options(CLI::App& command, SimulateArguments& arguments) {
  command.add_option("-o,--output", arguments.output, "Folder to write")->required();
  command
      .add_option("--seed", arguments.seed, "Seed of all random numbers; the same seed gives the same files")
      ->transform(whole_number(0, std::numeric_limits<std::int64_t>::max()))
      ->capture_default_str();
  command
      .add_option(
          "--optics", arguments.optics,
          "Lens, camera distance and dome of the gel: mini (GelSight Mini), flat (none), or an optics.yaml")
      ->type_name("mini|flat|FILE")
      ->capture_default_str();
  add_overwrite_flag(command, arguments.overwrite);
  add_quiet_flag(command, arguments.quiet);
}

void add_scan(CLI::App& simulate, const std::shared_ptr<SimulateArguments>& arguments, int& exit_code) {
  CLI::App* scan =
      simulate.add_subcommand("scan", "An object moved over the sensor, as a data folder with ground truth");
  SimulateArguments& a = *arguments;
  scan->add_option(
          "--object", a.scan.object.name,
          "Object (see gelslam simulate --list), or a mesh file. The seed changes it, too: for another "
          "scan of the same object give its SCAN/gt_mesh.ply")
      ->capture_default_str();
  scan->add_option("--size", a.scan.object.size, "Factor on the object's size")->capture_default_str();
  scan->add_option("--texture", a.scan.object.texture, "Factor on its texture's height; 0: polished")
      ->capture_default_str();
  scan->add_option("--motion", a.scan.motion.name, "Motion (see gelslam simulate --list)")
      ->capture_default_str();
  scan->add_option("--frames", a.scan.motion.frames, "Pictures after the 10 of the background")
      ->transform(whole_number(1, 200'000))
      ->capture_default_str();
  scan->add_option("--speed", a.scan.motion.speed, "Factor on how far the hand moves")->capture_default_str();
  scan->add_option("--indentation", a.scan.motion.indentation_mm,
                   "Depth to which the object is pressed in, mm")
      ->capture_default_str();
  scan->add_option("--dots", a.scan.optics.dot_spacing_mm,
                   "Print dots on the gel that move with it, this many mm apart; 2 without a number")
      ->type_name("[FLOAT]")
      ->expected(0, 1)
      ->default_str("2");
  add_common_options(*scan, a);
  scan->footer("Example: gelslam simulate scan --object pebble --motion allover --frames 1500 -o pebble");
  scan->callback([arguments, &exit_code] {
    run_scan(*arguments);
    exit_code = kExitDone;
  });
}

void add_presses(CLI::App& simulate, const std::shared_ptr<SimulateArguments>& arguments, int& exit_code) {
  CLI::App* presses = simulate.add_subcommand(
      "presses", "A hand that presses a ball all over the gel, as a log for gelslam calibrate collect");
  PressLogSpec& spec = arguments->press_log;
  presses->add_option("--diameter", spec.diameter_mm, "Diameter of the ball, mm")->capture_default_str();
  presses->add_option("--presses", spec.presses, "Number of presses")
      ->transform(whole_number(1, 10'000))
      ->capture_default_str();
  add_common_options(*presses, *arguments);
  presses->footer("Example: gelslam simulate presses --diameter 9.5 -o hand");
  presses->callback([arguments, &exit_code] {
    RunFolder folder(arguments->output, folder_options(*arguments, "touches.csv", "first_frame"));
    prepare(*arguments);
    StoppableProgress progress(arguments->quiet);
    write_press_log(folder.path(), arguments->press_log, progress);
    folder.commit();
    exit_code = kExitDone;
  });
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_code) {
  CLI::App* simulate =
      app.add_subcommand("simulate", "Make a log with ground truth: a virtual object on a virtual sensor");
  const auto arguments = std::make_shared<SimulateArguments>();
  simulate->add_flag("--list", arguments->list, "List objects and motions");
  simulate->require_subcommand(0, 1);
  add_presses(*simulate, arguments, exit_code);
  add_scan(*simulate, arguments, exit_code);
  simulate->footer(
      "Examples:\n  gelslam simulate --list\n  gelslam simulate scan --object coin --motion wobble -o coin");
  simulate->callback([simulate, arguments, &exit_code] {
    if (arguments->list) {
      print_catalog("objects (or a .ply, .obj or .stl file):", shape_catalog());
      print_catalog("motions:", motion_catalog());
    } else if (simulate->get_subcommands().empty()) {
      std::cout << simulate->help("gelslam");
    }
    exit_code = kExitDone;
  });
}

}  // namespace gelslam
