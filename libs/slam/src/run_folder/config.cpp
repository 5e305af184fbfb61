#include "gelslam/slam/config.hpp"

#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/options.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

void describe_sensor(OptionVisitor& visit, Config& config) {
  SensorProfile& sensor = config.sensor;
  visit.text("device_name", sensor.device_name, "for people");
  visit.number("ppmm", sensor.pixel_pitch_mm, kMinPixelPitchMm, kMaxPixelPitchMm,
               "mm per pixel after crop and resize");
  visit.integer("imgh", sensor.height_px, 32, 4096, "height of the calibrated image, pixels");
  visit.integer("imgw", sensor.width_px, 32, 4096, "width of the calibrated image, pixels");
  visit.integer("raw_imgh", sensor.raw_height_px, 32, 16384, "height of the camera's image before the crop");
  visit.integer("raw_imgw", sensor.raw_width_px, 32, 16384, "width of the camera's image before the crop");
  visit.flag("cropped", sensor.cropped, "pictures of other sizes, of about that shape, are only resized");
  visit.integer("video_track", sensor.video_track, 0, 99, "of a video with several, from 1; 0: the first");
  visit.number("framerate", sensor.frame_rate_hz, 0.1, 1000,
               "Hz: requested from a camera; of logs without times");
  visit.text("camera", sensor.camera, "/dev/videoN, part of the camera's name, or auto");
  visit.text("camera_format", sensor.camera_format, "MJPG or YUYV, at raw_imgw x raw_imgh");
  visit.text("camera_controls", sensor.camera_controls,
             "name=number, name=number; as gelslam devices names them");
  visit.path("calibration_model_path", sensor.calibration_model_path, "nnmodel.pth of this sensor");
  if (visit.section("optics", "of a sensor whose model does not say them",
                    [&] { describe_optics(visit, config.surface.optics); }))
    config.optics_from = "configuration";
  visit.number("color_gain_blue", config.color_gain_bgr[0], 0.1, 10,
               "factor on every picture, to use another sensor's model");
  visit.number("color_gain_green", config.color_gain_bgr[1], 0.1, 10, "the same for green");
  visit.number("color_gain_red", config.color_gain_bgr[2], 0.1, 10, "the same for red");
}

void describe_contact(OptionVisitor& visit, Config& config) {
  visit.ignored("color_dist_threshold");
  visit.ignored("height_threshold");
  visit.flag("compensate_light", config.surface.compensate_light, "follow changes of the light");
  visit.integer("background_frames", config.background_frames, 1, 10000,
                "first frames of the log, without contact");
}

void describe_curvature(OptionVisitor& visit, CurvatureLimits& limits) {
  visit.number("scr_threshold", limits.min_scr, 0, 1, "least shared curvature ratio");
  visit.number("ccs_threshold", limits.min_ccs, -1, 1, "least curvature cosine similarity");
}

void describe_registration(OptionVisitor& visit, NormalFlowOptions& options) {
  visit.integer("max_samples", options.max_samples, 50, 1000000, "keyframe pixels used");
  visit.integer("max_iterations", options.max_iterations, 1, 1000, "at most, per registration");
  visit.integer("min_iterations", options.min_iterations, 1, 1000, "at least, per registration");
  visit.number("robust_scale_rad", options.robust_scale_rad, 0.001, 10,
               "normals further apart than this lose weight");
  describe_curvature(visit, options.curvature);
}

void describe_tracking(OptionVisitor& visit, SlamOptions& slam, double pixel_pitch_mm) {
  TrackerOptions& options = slam.tracker;
  // The public configuration file states areas in pixels of its pitch.
  const double pixel_mm2 = pixel_pitch_mm * pixel_pitch_mm;
  int contact_px = static_cast<int>(std::lround(options.min_contact_mm2 / pixel_mm2));
  visit.integer("contact_threshold", contact_px, 1, 100000000,
                "contact pixels that begin a trial; fewer than a quarter are no contact");
  options.min_contact_mm2 = contact_px * pixel_mm2;
  visit.number("keyframe_min_shared", options.keyframe_min_shared, 0, 1,
               "a keyframe that shows less than this share of the frame's contact is replaced");
  visit.number("keyframe_min_unseen", options.keyframe_min_unseen, 0, 1,
               "share of its contact that a patch at a turning point alone must show");
  visit.number("patience_s", options.patience_s, 0, 10, "seconds without a pose after which a trial ends");
  visit.flag("relocalize", options.relocalize,
             "where registration fails, search for the one place where the textures agree");
  describe_registration(visit, slam.registration);
}

void describe_pose_graph(OptionVisitor& visit, SlamOptions& options) {
  visit.ignored("coverage_graph_overlap_threshold");
  LoopClosureOptions& loops = options.loop_closure;
  visit.integer("min_sift_inliers", loops.min_sift_inliers, 3, 100000, "matches that must agree on a place");
  describe_curvature(visit, options.verification.curvature);  // of a loop
  visit.number("loop_loss_scale", options.pose_graph.loop_loss_scale, 0.01, 1e6,
               "robust kernel on loops, in sigmas");
  visit.number("gradient_scale_sigma", options.gradient_scale.sigma, 0.001, 10,
               "prior standard deviation of read over true slope");
  visit.flag("estimate_gradient_scale", options.gradient_scale.estimate,
             "estimate read over true slope, along x and y, from loops");
  visit.integer("refine_pairs_per_keyframe", options.refinement.max_pairs_per_keyframe, 0, 10000,
                "overlapping keyframes that each is registered to when the log has ended, at most; 0: none");
}

OptionList describe(Config& config) {
  return [&config](OptionVisitor& visit) {
    visit.section("device_config", "the sensor", [&] { describe_sensor(visit, config); });
    visit.section("contact_mask_config", "detection of contact", [&] { describe_contact(visit, config); });
    visit.section("gelslam_config", "tracking and mapping", [&] {
      visit.section("track_config", "frame to keyframe",
                    [&] { describe_tracking(visit, config.slam, config.sensor.pixel_pitch_mm); });
      visit.section("pose_graph_config", "loops and poses", [&] { describe_pose_graph(visit, config.slam); });
      visit.section("fusion_config", "the mesh", [&, &fusion = config.slam.fusion] {
        visit.number("voxel_size_mm", fusion.voxel_size_mm, 0.01, 10, "edge of the mesh's cells");
        visit.number("truncation_mm", fusion.truncation_mm, 0.01, 20,
                     "sheets of one side closer than this become one");
      });
    });
  };
}

/// Sets values that depend on several keys, and checks the keys against each other.
Config completed(Config config, const std::filesystem::path& name) {
  const FusionOptions& fusion = config.slam.fusion;
  // Checked here and not only by fuse(), after the whole log was processed.
  if (fusion.truncation_mm < 2 * fusion.voxel_size_mm)
    throw Error(name.string() + ": fusion_config.truncation_mm must be at least twice voxel_size_mm");
  const SensorProfile& sensor = config.sensor;
  if (!is_possible_picture({sensor.width_px, sensor.height_px}, sensor.pixel_pitch_mm))
    throw Error(name.string() +
                ": device_config makes the gel more than 200 mm wide; check ppmm, imgw and imgh");
  config.surface.pixel_pitch_mm = sensor.pixel_pitch_mm;
  const std::string problem =
      why_impossible(config.surface.optics, sensor.width_px, sensor.height_px, sensor.pixel_pitch_mm);
  if (!problem.empty()) throw Error(name.string() + ": device_config.optics: " + problem);
  return config;
}

}  // namespace

Config read_config(const std::filesystem::path& file) {
  Config config;
  read_options(file, describe(config));
  return completed(config, file);
}

Config read_config_text(std::string_view yaml, const std::filesystem::path& name) {
  Config config;
  read_options_text(yaml, name, describe(config));
  return completed(config, name);
}

GradientModel read_gradient_model(const std::filesystem::path& file) {
  if (!is_matroska(file)) return read_model(file);
  const std::string model = read_log_attachments(file).model;
  if (model.empty())
    throw Error(file.string() + ": this log holds no gradient model; name one (nnmodel.pth)");
  return parse_model_file({reinterpret_cast<const unsigned char*>(model.data()), model.size()}, file.string())
      .model;
}

std::string write_config(const Config& config) {
  Config copy = config;
  return write_options(describe(copy));
}

}  // namespace gelslam
