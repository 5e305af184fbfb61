#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/core.hpp>
#include <span>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeightFile = "height_mm.npy";  // also tells our folders from others when overwriting
constexpr float kShownCurvature = 0.2F;               // 1/pixel, black or white in the picture

struct SurfaceArguments {
  fs::path image, background, model, output;
  double pitch_mm = SensorProfile{}.pixel_pitch_mm;
  bool overwrite = false, quiet = false;
};

cv::Mat3b read_sensor_image(const fs::path& path) {
  return fit_to_profile(read_image(path), SensorProfile{}, "'" + path.string() + "'");
}

cv::Mat1b height_picture(const cv::Mat1f& height_mm) {  // deepest black, highest white
  double lowest = 0.0, highest = 0.0;
  cv::minMaxLoc(height_mm, &lowest, &highest);
  const double scale = 255.0 / std::max(highest - lowest, 1e-6);
  cv::Mat1b picture;
  height_mm.convertTo(picture, CV_8U, scale, -scale * lowest);
  return picture;
}

cv::Mat3b normals_picture(const cv::Mat3f& normals) {  // R, G, B = x, y, z from -1..1 to 0..255
  cv::Mat3b picture(normals.size());
  std::transform(normals.begin(), normals.end(), picture.begin(), [](const cv::Vec3f& n) {
    const auto level = [](float value) { return cv::saturate_cast<unsigned char>(127.5F * (value + 1.0F)); };
    return cv::Vec3b(level(n[2]), level(n[1]), level(n[0]));
  });
  return picture;
}

cv::Mat1b curvature_picture(const cv::Mat1f& curvature) {  // 0 is mid-gray
  cv::Mat1b picture;
  curvature.convertTo(picture, CV_8U, 127.0 / kShownCurvature, 128.0);
  return picture;
}

/// The whole height map as a mesh in the sensor frame, seen from the object's side.
Mesh triangulate(const Surface& surface) {
  const int width = surface.height_mm.cols, height = surface.height_mm.rows;
  const auto pitch_mm = static_cast<float>(surface.pixel_pitch_mm);
  Mesh mesh;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      mesh.vertices_mm.emplace_back(
          (static_cast<float>(u) - 0.5F * static_cast<float>(width - 1)) * pitch_mm,
          (static_cast<float>(v) - 0.5F * static_cast<float>(height - 1)) * pitch_mm,
          surface.height_mm(v, u));
      const cv::Vec3f& normal = surface.normals(v, u);
      mesh.normals.emplace_back(normal[0], normal[1], normal[2]);
      if (u + 1 == width || v + 1 == height) continue;
      const int corner =
          v * width + u;  // x to the right, y down: this order turns counter-clockwise about +z
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

SurfacePtr estimate(const SurfaceArguments& arguments) {
  SurfaceOptions options;
  options.pixel_pitch_mm = arguments.pitch_mm;
  const cv::Mat3b background = read_sensor_image(arguments.background);
  if (const auto markers = find_marker_dots(background)) {
    if (!markers->are_readable())
      throw Error("'" + arguments.background.string() + "': " + markers->sentence());
    if (!arguments.quiet) std::cerr << "note: " << markers->sentence() << "\n";
  }
  const GradientModel model = read_gradient_model(arguments.model);
  if (model.maker && !arguments.quiet) std::cerr << "note: " << kMakerModelDoubt << "\n";
  SurfaceEstimator estimator(model, background, options);
  return estimator.estimate(read_sensor_image(arguments.image));
}

int run_surface(const SurfaceArguments& arguments) {
  RunFolder folder(arguments.output, {.overwrite = arguments.overwrite,
                                      .marker_file = kHeightFile,
                                      .known_entries = {kHeightFile, "height.png", "normals.png",
                                                        "contact.png", "curvature.png", "surface.ply"},
                                      .inputs = {arguments.image}});
  const SurfacePtr surface = estimate(arguments);
  write_surface(folder.path(), *surface);
  folder.commit();
  double deepest_mm = 0.0;
  cv::minMaxLoc(surface->height_mm, &deepest_mm, nullptr);
  if (!arguments.quiet)
    std::cout << fmt::format("contact {} pixels, deepest {:.3f} mm\n", surface->contact_pixels, -deepest_mm);
  return surface->contact_pixels > 0 ? kExitDone : kExitNotGood;
}

}  // namespace

void add_surface_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "surface", "Height, normals, contact and curvature of one image, as pictures and a mesh");
  const auto arguments = std::make_shared<SurfaceArguments>();
  command
      ->add_option("IMAGE", arguments->image,
                   "Picture of the touched gel (calibrated size, or raw from the camera)")
      ->required();
  command->add_option("--background", arguments->background, "Picture of the same gel untouched")->required();
  command->add_option("--model", arguments->model, "The sensor's gradient model nnmodel.pth")->required();
  command->add_option("-o,--output", arguments->output, "Folder to write")->required();
  command->add_option("--pitch", arguments->pitch_mm, "Millimeters per pixel")
      ->check(number_between(1e-4, 10.0))
      ->capture_default_str();
  add_overwrite_flag(*command, arguments->overwrite);
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Writes height_mm.npy (NumPy, 32-bit float), height.png, normals.png, contact.png, curvature.png, "
      "surface.ply.\n"
      "Exit code 1: nothing touches the gel.\n"
      "Example: gelslam surface touch.png --background background.png --model nnmodel.pth -o TOUCH");
  command->callback([arguments, &exit_code] { exit_code = run_surface(*arguments); });
}

}  // namespace gelslam
