#include "gelslam/calibration/press_set.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <set>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/zip_archive.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/background_drift.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr double kMinDiameterMm = 0.1, kMaxDiameterMm = 1000.0;
constexpr std::size_t kMaxLine = 4096, kMaxCatalogBytes = kMaxPresses * kMaxLine;

constexpr const char* kBlanks = " \t\r\"";

/// Says whether a name stays inside the folder; names come from a file that may be forged.
bool stays_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
}

/// Returns the number after the last comma of a line; nothing if anything else is there.
std::optional<double> diameter_in(const std::string& line) {
  const std::size_t comma = line.rfind(',');
  const std::string number = comma == std::string::npos ? "" : trimmed(line.substr(comma + 1), kBlanks);
  double diameter_mm = 0.0;
  const char* end = number.data() + number.size();
  const auto [stop, failure] = std::from_chars(number.data(), end, diameter_mm);
  return failure == std::errc() && stop == end ? std::optional(diameter_mm) : std::nullopt;
}

CalibrationPress parse_line(const std::string& line, const std::string& where) {
  CalibrationPress press;
  const auto diameter_mm = diameter_in(line);
  if (!diameter_mm) throw Error(where + " cannot be read: mend it (folder,diameter in mm) or take it out");
  press.diameter_mm = *diameter_mm;
  if (!(press.diameter_mm >= kMinDiameterMm && press.diameter_mm <= kMaxDiameterMm))
    throw Error(where + ": the diameter must be between 0.1 and 1000 mm");
  press.name = trimmed(line.substr(0, line.rfind(',')), kBlanks);
  // Catalogs made on Windows contain backslashes.
  std::replace(press.name.begin(), press.name.end(), '\\', '/');
  if (!stays_inside(press.name)) throw Error(where + ": the press must lie inside the calibration folder");
  return press;
}

std::vector<CalibrationPress> read_catalog(const fs::path& path) {
  std::ifstream stream(path);
  if (!fs::is_regular_file(path) || !stream)
    throw Error(
        quoted(path) +
        " cannot be read: a calibration folder has a catalog.csv with the lines folder,diameter in mm");
  if (fs::file_size(path) > kMaxCatalogBytes) throw Error(quoted(path) + " is too large for a catalog");
  std::vector<CalibrationPress> presses;
  std::set<std::string> names;
  std::string line;
  std::getline(stream, line);
  // As written by a spreadsheet program that uses decimal commas.
  const bool has_semicolons = line.find(';') != std::string::npos;
  if (diameter_in(line))
    throw Error(quoted(path) + " has no header: its first line must be experiment_reldir,diameter(mm)");
  for (int number = 2; std::getline(stream, line); ++number) {
    if (trimmed(line, kBlanks).empty()) continue;
    const std::string where = quoted(path) + " line " + std::to_string(number);
    if (line.size() > kMaxLine) throw Error(where + " is too long");
    if (has_semicolons) {
      std::replace(line.begin() + static_cast<std::ptrdiff_t>(line.rfind(';') + 1), line.end(), ',', '.');
      std::ranges::replace(line, ';', ',');
    }
    presses.push_back(parse_line(line, where));
    if (!names.insert(presses.back().name).second)
      throw Error(where + ": press '" + presses.back().name + "' is there twice");
    if (presses.size() > kMaxPresses)
      throw Error(quoted(path) + " names more than " + std::to_string(kMaxPresses) +
                  " presses: spread them over several folders");
  }
  if (presses.empty())
    throw Error(quoted(path) + " names no presses; delete it, and gelslam calibrate collect makes a new one");
  return presses;
}

cv::Mat3b read_background(const fs::path& path) {
  if (!fs::exists(path))
    throw Error(quoted(path) + " is missing: put a picture of the same gel with nothing on it there");
  cv::Mat3b background = read_image(path);
  if (std::min(background.rows, background.cols) < 16)
    throw Error(quoted(path) + " is " + size_text(background.cols, background.rows) +
                ", need at least 16x16");
  return background;
}

std::vector<double> numbers_in(const std::vector<ZipEntry>& entries, const std::string& name,
                               std::size_t count, const fs::path& path) {
  const auto entry =
      std::find_if(entries.begin(), entries.end(), [&](const ZipEntry& e) { return e.name == name; });
  if (entry == entries.end())
    throw Error(quoted(path) + ": '" + name + "' is missing (a label holds center and radius)");
  const std::vector<double> values = parse_npy(entry->contents, quoted(path) + ": " + name).to_doubles();
  if (values.size() != count)
    throw Error(quoted(path) + ": '" + name + "' holds " + std::to_string(values.size()) +
                " numbers, expected " + std::to_string(count));
  return values;
}

/// True for an image of a single color, as from a camera that delivers nothing. The noise of a real image is
/// at least half a gray level.
bool is_empty_picture(const cv::Mat3b& bgr) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(bgr, mean, deviation);
  constexpr double least_levels = 0.5;
  return std::max({deviation[0], deviation[1], deviation[2]}) < least_levels;
}

cv::Mat3b read_press_picture(const fs::path& path, const cv::Size& wanted) {
  cv::Mat3b bgr = read_image(path);
  if (bgr.size() != wanted)
    throw Error(quoted(path) + " is " + size_text(bgr.cols, bgr.rows) + " but the background is " +
                size_text(wanted.width, wanted.height) + ": all pictures must come from one sensor");
  if (is_empty_picture(bgr)) throw Error(quoted(path) + " shows nothing: it has one color all over");
  return bgr;
}

void read_press(const PressSet& set, bool any_gel, CalibrationPress& press) {
  const fs::path folder = set.folder / press.name;
  press.left_out = fs::exists(folder / kLeftOutFile);
  const fs::path label = folder / (press.left_out ? kLeftOutFile : kLabelFile);
  press.bgr = set.background;
  try {
    press.bgr = read_press_picture(folder / "gelsight.png", set.background.size());
    if (fs::exists(label)) press.label = read_label(label);
    const cv::Mat3b followed = in_light_of(set.background, press.bgr);
    if (!any_gel && !shows_same_gel(followed, set.background))
      throw Error(
          "its untouched gel does not look like background.png in any light that can be followed: another "
          "gel, sensor or crop (force takes it anyway)");
    press.bgr = followed;
  } catch (const Error& error) {
    press.problem = error.what();
  }
}

}  // namespace

ContactCircle read_label(const fs::path& path) {
  const std::vector<ZipEntry> entries = parse_zip(read_file(path), quoted(path));
  const std::vector<double> center = numbers_in(entries, "center.npy", 2, path);
  const std::vector<double> radius = numbers_in(entries, "radius.npy", 1, path);
  const ContactCircle circle{center[0], center[1], radius[0]};
  constexpr double far_px = 1e5;
  if (!(std::abs(circle.u_px) < far_px && std::abs(circle.v_px) < far_px && circle.radius_px > 0.0 &&
        circle.radius_px < far_px))
    throw Error(quoted(path) + " is no circle in a picture; delete it and label the press again");
  return circle;
}

void write_label(const fs::path& path, const ContactCircle& circle) {
  const double center[] = {circle.u_px, circle.v_px}, radius[] = {circle.radius_px};
  write_zip(path, {{"center.npy", format_npy({2}, center)}, {"radius.npy", format_npy({}, radius)}});
}

PressSet read_press_set(const fs::path& folder, bool any_gel) {
  if (!fs::is_directory(folder)) throw Error(quoted(folder) + " is no folder of ball presses");
  PressSet set;
  set.folder = folder;
  set.presses = read_catalog(folder / "catalog.csv");
  set.background = read_background(folder / "background.png");
  set.optics = find_optics(folder / "catalog.csv");
  for (CalibrationPress& press : set.presses) read_press(set, any_gel, press);
  return set;
}

void prepare(PressSet& set, const SensorOptics& optics, double pixel_pitch_mm, const std::string& device_name,
             const std::function<void(const std::string&)>& say_warning) {
  if (!set.optics) set.optics = optics;
  const std::string problem =
      why_impossible(*set.optics, set.background.cols, set.background.rows, pixel_pitch_mm);
  if (!problem.empty()) throw Error(quoted(set.folder) + ": the sensor's optics: " + problem);
  require_readable_background(set.background, device_name, quoted(set.folder / "background.png"),
                              say_warning);
  const MarkerFiller filler(set.background);
  for (CalibrationPress& press : set.presses) press.bgr = filler.fill(press.bgr, press.covered);
  set.background = filler.background();
}

}  // namespace gelslam
