#include <fmt/core.h>

#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/simulation/calibration_set.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/simulation/press_log.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct SimulateArguments {
  ScanSpec scan;
  CalibrationSpec calibration;
  PressLogSpec press_log;
  DataFolderOptions folder;
  std::filesystem::path output, calibration_folder;
  std::string optics;
  std::vector<double> place_mm;  // x, y
  std::uint64_t seed = 1;
  MeshUnit unit;
  bool list = false, quiet = false, overwrite = false;
};

void print_catalog(const std::string& title, const std::vector<CatalogEntry>& entries) {
  std::cout << title << "\n";
  for (const CatalogEntry& entry : entries)
    std::cout << "  " << std::left << std::setw(12) << entry.name << entry.description << "\n";
}

void print_lists() {
  print_catalog("objects (or a .ply, .obj or .stl file):", shape_catalog());
  print_catalog("motions:", motion_catalog());
}

void throw_stopped() { throw Error("stopped; nothing was written"); }

/// All that any of the commands writes.
std::vector<std::string> simulated_files() {
  std::vector<std::string> files;
  for (const std::string folder : {"", "calibration/"})
    for (const char* file :
         {"gelsight.avi", "config.yaml", "meta.json", "gt_mesh.ply", "touched.npy", "true_start_T_currs.npy",
          "true_heights.npy", "true_contacts.npy", "touches.csv", "catalog.csv", "circles.csv",
          "background.png", "optics.yaml", "model/nnmodel.pth", "model/optics.yaml", "*/*/gelsight.png"})
      files.push_back(folder + file);
  return files;
}

/// `truth`: the file by which a folder is known to be simulated. A mesh to simulate is an input, too.
RunFolderOptions folder_options(const SimulateArguments& arguments, const char* truth) {
  const std::filesystem::path object = arguments.scan.object.name;
  return {.overwrite = arguments.overwrite,
          .marker_file = truth,
          .known_entries = simulated_files(),
          .inputs = {object.has_extension() ? object : "", arguments.calibration_folder}};
}

/// One seed for everything; the sensor (noise, dirt) is the same for a scan and its calibration.
void spread_seed(SimulateArguments& arguments) {
  arguments.scan.object.seed = arguments.scan.motion.seed = arguments.scan.optics.seed = arguments.seed;
  arguments.calibration.seed = arguments.seed;
  arguments.calibration.optics = arguments.scan.optics;
  arguments.press_log.seed = arguments.seed;
  arguments.press_log.optics = arguments.scan.optics;
}

/// Those of the calibration that is used, unless a person says others.
SensorOptics optics_of(const SimulateArguments& arguments) {
  if (arguments.optics == "mini") return kGelSightMiniOptics;
  if (arguments.optics == "flat") return {};
  if (!arguments.optics.empty()) return read_optics(arguments.optics);
  const std::filesystem::path& calibration = arguments.calibration_folder;
  const auto found = calibration.empty() ? std::nullopt : find_optics(calibration / kOpticsFileName);
  return found.value_or(kGelSightMiniOptics);
}

/// The same sensor for all, but for the seeds.
void prepare(SimulateArguments& arguments) {
  spread_seed(arguments);
  arguments.scan.geometry.optics = optics_of(arguments);
  arguments.calibration.geometry = arguments.press_log.geometry = arguments.scan.geometry;
}

void calibrate_into(const std::filesystem::path& folder, const SimulateArguments& arguments,
                    ProgressSink& progress) {
  const HeldOutScale scale = write_calibration_folder(folder, arguments.calibration, progress);
  std::cerr << std::fixed << std::setprecision(3) << "gradient scale on presses not trained on: x " << scale.x
            << ", y " << scale.y << "; mean error " << std::setprecision(2) << scale.mean_error_deg
            << " degrees\n";
}

void run_scan(SimulateArguments& arguments) {
  prepare(arguments);
  if (!arguments.place_mm.empty())
    arguments.scan.motion.place_mm = {arguments.place_mm[0], arguments.place_mm[1]};
  StoppableProgress progress(arguments.quiet, throw_stopped);
  ShapeSpec& object = arguments.scan.object;
  object.mesh_unit_mm = arguments.unit.mm(object.name);
  RunFolder folder(arguments.output, folder_options(arguments, "meta.json"));
  arguments.folder.name = name_of(folder.final_path());
  const Simulator simulator(arguments.scan);  // first: it knows whether object and motion exist
  if (!arguments.quiet) arguments.unit.say(object.name);
  const bool given = !arguments.calibration_folder.empty();
  const std::filesystem::path calibration =
      given ? arguments.calibration_folder : folder.path() / "calibration";
  arguments.folder.model = calibration / "model" / "nnmodel.pth";
  if (given && !std::filesystem::exists(arguments.folder.model))
    throw Error(calibration.string() +
                " holds no model/nnmodel.pth; make one with: gelslam simulate calibration -o " +
                calibration.string());
  if (!given) calibrate_into(calibration, arguments, progress);
  write_data_folder(folder.path(), simulator, arguments.folder, progress);
  folder.commit();
}

void add_common_options(CLI::App& command, SimulateArguments& arguments) {
  command.add_option("-o,--output", arguments.output, "Folder to write")->required();
  command
      .add_option("--seed", arguments.seed, "Seed of all random numbers; the same seed gives the same files")
      ->capture_default_str();
  command.add_option("--noise", arguments.scan.optics.noise_gain, "Factor on the sensor's noise")
      ->capture_default_str();
  command.add_flag("--dirt", arguments.scan.optics.dirt, "Specks and grains that stay on the gel");
  command
      .add_option("--optics", arguments.optics,
                  "Lens, camera distance and dome of the gel: mini (GelSight Mini), flat (none), or an "
                  "optics.yaml; default: those of --calibration, else mini")
      ->type_name("mini|flat|FILE");
  add_overwrite_flag(command, arguments.overwrite);
  add_quiet_flag(command, arguments.quiet);
}

void add_dots_option(CLI::App& command, SimulateArguments& arguments) {
  command
      .add_option("--dots", arguments.scan.optics.dot_spacing_mm,
                  "Print dots on the gel that move with it, this many mm apart; 2 without a number")
      ->type_name("[FLOAT]")
      ->expected(0, 1)
      ->default_str("2");
}

void add_scan(CLI::App& simulate, const std::shared_ptr<SimulateArguments>& arguments, int& exit_code) {
  CLI::App* scan =
      simulate.add_subcommand("scan", "An object moved over the sensor, as a data folder with ground truth");
  SimulateArguments& a = *arguments;
  scan->add_option("--object", a.scan.object.name, "Object (see gelslam simulate --list), or a mesh file")
      ->capture_default_str();
  scan->add_option("--size", a.scan.object.size, "Factor on the object's size")->capture_default_str();
  scan->add_option("--texture", a.scan.object.texture, "Factor on its texture's height; 0: polished")
      ->capture_default_str();
  a.unit.add_to(*scan);
  scan->add_option("--motion", a.scan.motion.name, "Motion (see gelslam simulate --list)")
      ->capture_default_str();
  scan->add_option("--frames", a.scan.motion.frames, "Pictures after the 10 of the background")
      ->capture_default_str();
  scan->add_option("--speed", a.scan.motion.speed, "Factor on how far the hand moves")->capture_default_str();
  scan->add_option("--indentation", a.scan.motion.indentation_mm,
                   "Depth to which the object is pressed in, mm")
      ->capture_default_str();
  scan->add_option("--place", a.place_mm, "X,Y: where on the gel the contact is, mm from its center")
      ->delimiter(',')
      ->expected(2);
  scan->add_option("--calibration", a.calibration_folder,
                   "Calibration folder to use; else one is made in DIR/calibration");
  scan->add_flag("--light-drift", a.scan.optics.light_drift, "Let the lamps drift by a few percent");
  scan->add_flag("--lossless", a.folder.lossless, "PNG instead of JPEG pictures in the video");
  scan->add_flag("--truth-maps", a.folder.truth_maps,
                 "Also write the true heights and contacts of every frame");
  scan->add_option("--threads", a.folder.threads, "Number of threads (0: all); the files do not depend on it")
      ->capture_default_str();
  add_dots_option(*scan, a);
  add_common_options(*scan, a);
  scan->footer("Example: gelslam simulate scan --object pebble --motion allover --frames 600 -o pebble");
  scan->callback([arguments, &exit_code] {
    run_scan(*arguments);
    exit_code = kExitDone;
  });
}

void add_calibration(CLI::App& simulate, const std::shared_ptr<SimulateArguments>& arguments,
                     int& exit_code) {
  CLI::App* calibration = simulate.add_subcommand(
      "calibration", "Ball presses of the simulated sensor, and the network trained on them");
  calibration->add_option("--presses", arguments->calibration.presses, "Number of ball presses")
      ->capture_default_str();
  calibration->add_option("--epochs", arguments->calibration.training.epochs, "Training epochs")
      ->capture_default_str();
  add_dots_option(*calibration, *arguments);
  add_common_options(*calibration, *arguments);
  calibration->footer("Example: gelslam simulate calibration -o calibration");
  calibration->callback([arguments, &exit_code] {
    prepare(*arguments);
    StoppableProgress progress(arguments->quiet, throw_stopped);
    RunFolder folder(arguments->output, folder_options(*arguments, "circles.csv"));
    calibrate_into(folder.path(), *arguments, progress);
    folder.commit();
    exit_code = kExitDone;
  });
}

void add_presses(CLI::App& simulate, const std::shared_ptr<SimulateArguments>& arguments, int& exit_code) {
  CLI::App* presses = simulate.add_subcommand(
      "presses", "A hand that presses a ball all over the gel, as a log for gelslam calibrate collect");
  PressLogSpec& spec = arguments->press_log;
  presses->add_option("--diameter", spec.diameter_mm, "Diameter of the ball, mm")->capture_default_str();
  presses->add_option("--presses", spec.presses, "Number of good presses")->capture_default_str();
  presses->add_flag("--mishaps", spec.mishaps,
                    "Bad presses between them: sliding, too deep, too shallow, off the gel, two at once");
  presses
      ->add_option("--background-frames", spec.background_frames,
                   "Frames of the bare gel at the start; with 0 the ball lies on it already")
      ->capture_default_str();
  presses->add_flag("--lossless", arguments->folder.lossless, "PNG instead of JPEG pictures in the video");
  add_common_options(*presses, *arguments);
  presses->footer("Example: gelslam simulate presses --diameter 9.5 --mishaps -o hand");
  presses->callback([arguments, &exit_code] {
    RunFolder folder(arguments->output, folder_options(*arguments, "touches.csv"));
    prepare(*arguments);
    StoppableProgress progress(arguments->quiet, throw_stopped);
    write_press_log(folder.path(), arguments->press_log, arguments->folder.lossless, progress);
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
  add_calibration(*simulate, arguments, exit_code);
  add_presses(*simulate, arguments, exit_code);
  add_scan(*simulate, arguments, exit_code);
  simulate->footer(
      "Examples:\n  gelslam simulate --list\n  gelslam simulate calibration -o calibration\n"
      "  gelslam simulate scan --object coin --motion wobble --calibration calibration -o coin");
  simulate->callback([simulate, arguments, &exit_code] {
    if (arguments->list)
      print_lists();
    else if (simulate->get_subcommands().empty())
      std::cout << simulate->help();
    exit_code = kExitDone;
  });
}

}  // namespace gelslam
