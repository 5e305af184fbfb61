#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {

/// All settings of a run, with working defaults. Files have the keys of the public GelSLAM
/// configuration (device_config, contact_mask_config, gelslam_config) and our own optional ones;
/// docs/file-formats.md lists them.
struct Config {
  SensorProfile sensor;
  SurfaceOptions surface;
  SlamOptions slam;
  int background_frames = 10;  ///< the log's first frames, without contact
  /// Factors on every picture's blue, green and red, background included, before anything looks at it: for a
  /// log from a sensor that is brighter or darker than the one the model was trained on.
  std::array<double, 3> color_gain_bgr = {1.0, 1.0, 1.0};
  /// Who says surface.optics: "configuration", "log", "model" or "GelSight Mini"; "default": flat gel.
  std::string optics_from = "default";
};

/// Throws Error with file and line on unknown keys, wrong types and values out of range.
Config read_config(const std::filesystem::path& file);

/// The same from text; `name` stands for the file in errors, and relative paths count from its folder.
Config read_config_text(std::string_view yaml, const std::filesystem::path& name);

/// Reads nnmodel.pth, or the model that a recorded log (Matroska) holds. Throws Error.
GradientModel read_gradient_model(const std::filesystem::path& file);

/// The effective configuration as YAML with a comment per key; read_config gives the same values back.
std::string write_config(const Config& config);

/// Frames of a log, from 0, both included.
struct FrameRange {
  std::int64_t first = 0, last = 0;
};

/// What a person names on the command line.
struct LogInput {
  std::filesystem::path
      log{};  ///< recorded log, video, folder of images, or data folder of the public layout
  std::filesystem::path
      config{};  ///< empty: the one in the log, else config.yaml in or beside it, else the defaults
  /// nnmodel.pth or a log that holds one. Empty: the one that `config` names, else the one in the log, else
  /// the one that the log's configuration names.
  std::filesystem::path model{};
  std::filesystem::path background{};  ///< an image; empty: the log's first frames
  bool force = false;                  ///< go on although the background frames seem to show contact
  /// The frames that show the bare gel; earlier ones are left out.
  std::optional<FrameRange> background_frames = {};
  bool cropped = false;            ///< SensorProfile::cropped, whatever the configuration says
  bool counts_from_start = false;  ///< SensorProfile::counts_from_start
  int track = 0;                   ///< SensorProfile::video_track, where it is not 0
};

/// For a log that continues a run, or a camera in the map of a run (`run` is not empty): the configuration is
/// the run's unless `input` names another. A model that the log holds stays, so that a log of another sensor
/// is refused. Throws Error when there is no such folder.
LogInput with_settings_of_run(LogInput input, const std::filesystem::path& run);

/// The configuration that `input` asks for, with the model path resolved. Throws Error.
Config resolve_config(const LogInput& input);

/// The same where a model is not needed, or there is no log yet (an empty name: a camera is to be read).
Config find_config(const LogInput& input);

struct LogAttachments;
/// What a log that is recorded with this configuration should hold: the configuration, and the model's file
/// (of a log: the model in it) so that the log can be reconstructed on its own anywhere. Throws Error when
/// the model is not one.
LogAttachments attachments_of(const Config& config);

}  // namespace gelslam
