#include <fmt/core.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <optional>
#include <span>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

// Also identifies folders of this command when they are overwritten.
constexpr const char* kHeightFile = "height_mm.npy";
constexpr float kShownCurvature = 0.2F;  // Curvature in 1/pixel that is shown black or white.

struct SurfaceArguments {
  fs::path image, background, config, model, output;
  bool force = false, overwrite = false, quiet = false;
};

cv::Mat1b height_picture(const cv::Mat1f& height_mm) {  // The lowest point is black, the highest white.
  double lowest = 0.0, highest = 0.0;
  cv::minMaxLoc(height_mm, &lowest, &highest);
  const double scale = 255.0 / std::max(highest - lowest, 1e-6);
  cv::Mat1b picture;
  height_mm.convertTo(picture, CV_8U, scale, -scale * lowest);
  return picture;
}

cv::Mat3b normals_picture(const cv::Mat3f& normals) {  // R, G, B = x, y, z, mapped from -1..1 to 0..255.
  cv::Mat3b picture(normals.size());
  std::transform(normals.begin(), normals.end(), picture.begin(), [](const cv::Vec3f& n) {
    const auto level = [](float value) { return cv::saturate_cast<unsigned char>(127.5F * (value + 1.0F)); };
    return cv::Vec3b(level(n[2]), level(n[1]), level(n[0]));
  });
  return picture;
}

cv::Mat1b curvature_picture(const cv::Mat1f& curvature) {  // 0 is mid-gray.
  cv::Mat1b picture;
  curvature.convertTo(picture, CV_8U, 127.0 / kShownCurvature, 128.0);
  return picture;
}

/// Returns the whole height map as a mesh in the sensor frame, facing the object.
Mesh triangulate(const Surface& surface) {
  const int width = surface.height_mm.cols, height = surface.height_mm.rows;
  const CameraModel camera = surface.camera();
  Mesh mesh;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      mesh.vertices_mm.push_back(camera.point_mm(
          camera.to_mm(Eigen::Vector2f(Eigen::Vector2i(u, v).cast<float>())), surface.height_mm(v, u)));
      const cv::Vec3f& normal = surface.normals(v, u);
      mesh.normals.emplace_back(normal[0], normal[1], normal[2]);
      if (u + 1 == width || v + 1 == height) continue;
      const int corner =
          v * width + u;  // With x to the right and y down, this order is counter-clockwise about +z.
      mesh.triangles.emplace_back(corner, corner + 1, corner + width);
      mesh.triangles.emplace_back(corner + 1, corner + width + 1, corner + width);
    }
  }
  return mesh;
}

void write_surface(const fs::path& folder, const Surface& surface) {
  const cv::Mat1f& height = surface.height_mm;
  write_npy(folder / kHeightFile,
            {static_cast<std::size_t>(height.rows), static_cast<std::size_t>(height.cols)},
            std::span(height.ptr<const float>(), height.total()));
  write_png(folder / "height.png", height_picture(surface.height_mm));
  write_png(folder / "normals.png", normals_picture(surface.normals));
  write_png(folder / "contact.png", surface.contact);
  write_png(folder / "curvature.png", curvature_picture(surface.curvature));
  write_mesh(folder / "surface.ply", triangulate(surface));
}

Config config_for(const SurfaceArguments& arguments) {
  Config config = find_config({.log = arguments.image, .config = arguments.config, .model = arguments.model});
  if (config.sensor.calibration_model_path.empty())
    throw Error("no gradient model: give --model nnmodel.pth, or --config with calibration_model_path");
  config.background_frames = 1;
  return config;
}

/// Reads an image of the sensor. Throws Error if red and blue are exchanged or the image is upside down.
cv::Mat3b read_sensor_image(const fs::path& path, const Config& config, bool force) {
  cv::Mat3b picture = fit_to_profile(read_image(path), config.sensor, quoted(path));
  const std::string turned = judge_orientation(picture, config.sensor.device_name);
  if (!turned.empty() && !force) throw Error(quoted(path) + ": " + turned + " (--force continues anyway)");
  return picture;
}

struct CheckedSurface {
  SurfacePtr surface;
  std::vector<std::string> warnings;  ///< Warnings about the background.
  std::string mismatch;               ///< Why image and background do not belong together, or "".
};

/// Processes background and image in the same way as the first frames of a log.
CheckedSurface estimate(const SurfaceArguments& arguments) {
  const Config config = config_for(arguments);
  cv::Mat3b background = read_sensor_image(arguments.background, config, arguments.force);
  cv::Mat3b picture = read_sensor_image(arguments.image, config, arguments.force);
  CheckedSurface result;
  if (!shows_same_gel(in_light_of(background, picture), background))
    result.mismatch =
        "the untouched gel does not look like the background in any light that can be followed: another gel "
        "or sensor";
  StageTimer timer;
  // The range marks frame 0 as a background named by the user.
  FrameToSurface frames(config, {}, arguments.force, timer, FrameRange{0, 0});
  frames.push(background, 0);
  if (!frames.has_background())
    throw Error(quoted(arguments.background) + ": " + frames.refusal().reason +
                " (--force continues anyway)");
  result.warnings = frames.warnings();
  result.surface = frames.push(picture, 1);
  if (!result.surface->zero_is_bare_gel && result.mismatch.empty())
    result.mismatch =
        "no bare gel is seen around the contact: heights are right among themselves only, "
        "unless picture and background do not belong together";
  return result;
}

struct BallDiameter {
  double mm, sigma_mm;
};

/// Returns the diameter of the ball that fits the middle of the contact, around its deepest point. The
/// normals of a ball of radius R change by -1 / R with the position; this rate is fitted by weighted least
/// squares. Slopes that are read too steep or too flat are wrong over the whole contact. As such errors are
/// correlated, the relative standard deviation is the total residual of the slopes over the slopes
/// themselves. Returns nothing if it is more than half of the diameter.
std::optional<BallDiameter> ball_diameter(const Surface& surface) {
  cv::Point deepest;
  cv::minMaxLoc(surface.height_mm, nullptr, nullptr, &deepest);
  const double reach_px = 0.5 * std::sqrt(surface.contact_pixels / CV_PI);
  double weights = 0, squared_mm = 0, squared_slope = 0, product = 0;
  Eigen::Vector2d sum_mm(0, 0), sum_slope(0, 0);
  for (int v = 0; v < surface.contact.rows; ++v)
    for (int u = 0; u < surface.contact.cols; ++u) {
      if (surface.contact(v, u) == 0 || std::hypot(u - deepest.x, v - deepest.y) >= reach_px) continue;
      const double weight = surface.confidence(v, u);
      const Eigen::Vector2d at_mm = surface.point_mm({u, v}).head<2>();
      const Eigen::Vector2d slope(surface.normals(v, u)[0], surface.normals(v, u)[1]);
      weights += weight;
      sum_mm += weight * at_mm;
      sum_slope += weight * slope;
      squared_mm += weight * at_mm.squaredNorm();
      squared_slope += weight * slope.squaredNorm();
      product += weight * at_mm.dot(slope);
    }
  const double moment = squared_mm - sum_mm.squaredNorm() / weights;
  const double curvature = (sum_mm.dot(sum_slope) / weights - product) / moment;  // 1/mm
  const double explained = curvature * curvature * moment,
               residual = squared_slope - sum_slope.squaredNorm() / weights - explained;
  const double relative = std::sqrt(std::max(0.0, residual) / explained);
  if (!(curvature > 0 && relative < 0.5)) return std::nullopt;  // Also true for NaN.
  return BallDiameter{2 / curvature, 2 / curvature * relative};
}

int run_surface(const SurfaceArguments& arguments) {
  RunFolder folder(arguments.output, {.overwrite = arguments.overwrite,
                                      .marker_file = kHeightFile,
                                      .known_entries = {kHeightFile, "height.png", "normals.png",
                                                        "contact.png", "curvature.png", "surface.ply"},
                                      .inputs = {arguments.image}});
  const auto [surface, warnings, mismatch] = estimate(arguments);
  write_surface(folder.path(), *surface);
  folder.commit();
  double deepest_mm = 0.0;
  cv::minMaxLoc(surface->height_mm, &deepest_mm, nullptr);
  const auto ball = ball_diameter(*surface);
  for (const std::string& warning : warnings) print_line("warning: " + warning);
  if (!mismatch.empty()) print_line("warning: " + mismatch);
  if (!arguments.quiet)
    std::cout << fmt::format("contact {} pixels, deepest {:.3f} mm", surface->contact_pixels, -deepest_mm)
              << (ball ? fmt::format("; its middle is round as a ball of {:.1f} +- {:.1f} mm", ball->mm,
                                     ball->sigma_mm)
                       : "")
              << "\n";
  return surface->contact_pixels > 0 && mismatch.empty() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_surface_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "surface", "Height, normals, contact and curvature of one image, as pictures and a mesh");
  auto& arguments = options_of(*command, exit_code, run_surface);
  command
      ->add_option("IMAGE", arguments.image,
                   "Picture of the touched gel (calibrated size, or raw from the camera)")
      ->required();
  command->add_option("--background", arguments.background, "Picture of the same gel untouched")->required();
  command->add_option("--config", arguments.config,
                      "The sensor's configuration (default: config.yaml beside IMAGE, else GelSight Mini)");
  command->add_option("--model", arguments.model,
                      "The sensor's gradient model nnmodel.pth (default: the one the configuration names)");
  command->add_option("-o,--output", arguments.output, "Folder to write")->required();
  command->add_flag("--force", arguments.force, "Continue although background or picture seem to be wrong");
  add_overwrite_flag(*command, arguments.overwrite);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Writes height_mm.npy (NumPy, 32-bit float), height.png, normals.png, contact.png, curvature.png, "
      "surface.ply.\n"
      "Exit code 1: nothing touches the gel, or picture and background do not belong together.\n"
      "Example: gelslam surface touch.png --background background.png --model nnmodel.pth -o TOUCH");
}

}  // namespace gelslam
