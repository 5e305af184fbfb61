#include <fmt/core.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/pixel_pitch.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct PitchArguments {
  PressOptions presses;
  std::vector<fs::path> patterns;
  fs::path background;
  double period_mm = 0.0;
};

/// "...; square, within 2 %" or what is to be done.
std::string square_words(bool square) {
  if (square) return fmt::format("; square, within {:.0f} %", 100.0 * kMaxUnsquare);
  return fmt::format(
      ", more than {:.0f} % off: pictures must be stretched to square ones before they are used",
      100.0 * kMaxUnsquare);
}

/// Prints what the patterns say; true when the configuration says about the same.
bool print_pattern_pitch(const PixelPitch& pitch, double configured_mm) {
  if (pitch.both_axes) {
    fmt::print("pitch: x {:.5f} +- {:.5f}, y {:.5f} +- {:.5f} mm per pixel\n", pitch.x_mm,
               pitch.x_uncertainty_mm, pitch.y_mm, pitch.y_uncertainty_mm);
  } else {
    fmt::print(
        "pitch: {:.5f} +- {:.5f} mm per pixel along the pattern; turn it by 90 degrees for the other axis\n",
        pitch.x_mm, pitch.x_uncertainty_mm);
  }
  const double mean_mm = std::sqrt(pitch.x_mm * pitch.y_mm), y_over_x = pitch.y_mm / pitch.x_mm;
  const double uncertainty =
      std::hypot(pitch.x_uncertainty_mm / pitch.x_mm, pitch.y_uncertainty_mm / pitch.y_mm);
  const bool square = !pitch.both_axes || pixels_are_square(y_over_x, uncertainty);
  const bool as_configured = std::abs(mean_mm / configured_mm - 1.0) <= kMaxPitchError;
  if (pitch.both_axes)
    fmt::print("pixels are {:.3f} +- {:.3f} times as high as wide{}\n", y_over_x, uncertainty,
               square_words(square));
  if (as_configured)
    fmt::print("that is the {:.5f} of the configuration, within {:.0f} %\n", configured_mm,
               100.0 * kMaxPitchError);
  else
    fmt::print("the configuration says {:.5f}: write ppmm: {:.5f}, and calibrate again\n", configured_mm,
               mean_mm);
  return square && as_configured;
}

PatternWave wave_in(const fs::path& path, const cv::Mat3b& background, const SensorProfile& profile,
                    double period_px, double period_mm) {
  const cv::Mat3b picture = fit_to_profile(read_image(path), profile, quoted(path));
  if (picture.size() != background.size())
    throw Error(quoted(path) + " is " + size_text(picture.cols, picture.rows) + " but the background is " +
                size_text(background.cols, background.rows));
  const auto wave = find_pattern(picture, background, period_px);
  if (!wave)
    throw Error(
        quoted(path) +
        fmt::format(
            ": no pattern of {:.2f} mm stands out (looked for {:.0f} to {:.0f} pixels per period); press "
            "it in evenly, at least four periods of it, and give --pitch if the "
            "configuration's is far off",
            period_mm, 0.8 * period_px, 1.25 * period_px));
  fmt::print("{}: {:.3f} pixels per period (halves of the picture differ by {:.2f} %)\n", path.string(),
             wave->period_px(), 200.0 * wave->uncertainty);
  return *wave;
}

bool measure_patterns(const PitchArguments& arguments) {
  const PressOptions& presses = arguments.presses;
  const Config config = presses.config.empty() ? Config{} : read_config(presses.config);
  const double pitch_mm = presses.given_pitch_mm.value_or(config.surface.pixel_pitch_mm);
  const fs::path background_file =
      !arguments.background.empty() ? arguments.background : presses.folder / "background.png";
  const cv::Mat3b background =
      fit_to_profile(read_image(background_file), config.sensor, quoted(background_file));
  std::vector<PatternWave> waves;
  for (const fs::path& path : arguments.patterns)
    waves.push_back(
        wave_in(path, background, config.sensor, arguments.period_mm / pitch_mm, arguments.period_mm));
  return print_pattern_pitch(pitch_from_pattern(waves, arguments.period_mm), pitch_mm);
}

bool measure_balls(PressOptions& options) {
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(options.quiet);
  const PressSet set = read_presses(options);
  const BallZones zones = find_zones_for_people(set, options, true, *progress, interrupt);
  const auto aspect = aspect_from_balls(set, zones.zones, options.pitch_mm);
  if (!aspect) {
    fmt::print("pixel aspect: too few presses lie whole in the picture (five are needed)\n");
    return false;
  }
  const bool square = pixels_are_square(aspect->y_over_x, aspect->uncertainty);
  fmt::print("pixels are {:.3f} +- {:.3f} times as high as wide, by the round contacts of {} presses{}\n",
             aspect->y_over_x, aspect->uncertainty, aspect->presses, square_words(square));
  fmt::print(
      "balls do not show the pitch itself: press in something of known period (--pattern, --period)\n");
  return square;
}

int run_pitch(PitchArguments arguments) {
  if (arguments.presses.folder.empty() && arguments.patterns.empty())
    throw Error("give a folder of ball presses, or pictures of a pattern (--pattern FILE... --period MM)");
  if (!arguments.patterns.empty() && arguments.background.empty() && arguments.presses.folder.empty())
    throw Error("give --background: a picture of the gel with nothing on it");
  bool fits = true;
  if (!arguments.patterns.empty()) fits = measure_patterns(arguments);
  if (!arguments.presses.folder.empty() && arguments.patterns.empty())
    fits = measure_balls(arguments.presses);
  return fits ? kExitDone : kExitNotGood;
}

}  // namespace

void add_calibrate_pitch_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("pitch", "Measure the millimeters per pixel");
  const auto arguments = std::make_shared<PitchArguments>();
  arguments->presses.add_to(*command);
  command->get_option("PRESSES")->required(false);
  CLI::Option* patterns =
      command->add_option("--pattern", arguments->patterns,
                          "Pictures of something with marks at even distances, pressed into the gel");
  CLI::Option* period = command->add_option("--period", arguments->period_mm, "Distance of the marks, mm")
                            ->check(number_between(0.05, 50.0));
  patterns->needs(period);
  period->needs(patterns);
  command->add_option("--background", arguments->background,
                      "Picture of the bare gel (default: background.png of PRESSES)");
  command->footer(
      "Lay a steel ruler or a bolt on the gel (thread of M4: 0.7 mm, M5: 0.8, M6: 1.0), once along x and "
      "once along y,\n"
      "and take a picture of each. Balls alone show only whether pixels are square. Exit code 1 when the "
      "configuration\n"
      "says something else, or pixels are not square.\n"
      "Example: gelslam calibrate pitch --pattern bolt_x.png bolt_y.png --period 0.8 --background "
      "background.png");
  command->callback([arguments, &exit_code] { exit_code = run_pitch(*arguments); });
}

}  // namespace gelslam
