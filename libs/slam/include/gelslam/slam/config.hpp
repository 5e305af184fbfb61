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

/// All settings of a run, with working defaults. Configuration files use the keys of the public GelSLAM
/// configuration (device_config, contact_mask_config, gelslam_config) and optional ones of this program;
/// docs/file-formats.md lists them.
struct Config {
  SensorProfile sensor;
  SurfaceOptions surface;
  SlamOptions slam;
  /// Number of frames at the beginning of the log that show the gel without contact.
  int background_frames = 10;
  /// Factors by which the blue, green and red channel of every image are multiplied before anything else,
  /// background included. They are for a log from a sensor that is brighter or darker than the one that the
  /// gradient model was trained on.
  std::array<double, 3> color_gain_bgr = {1.0, 1.0, 1.0};
  /// Where surface.optics comes from: "configuration", "log", "model" or "GelSight Mini"; "default" stands
  /// for the flat gel.
  std::string optics_from = "default";
};

/// Throws Error with file and line on unknown keys, wrong types and values out of range.
Config read_config(const std::filesystem::path& file);

/// Reads a configuration from text. `name` stands for the file in errors, and relative paths are relative to
/// its folder.
Config read_config_text(std::string_view yaml, const std::filesystem::path& name);

/// Reads nnmodel.pth, or the model that a recorded log (Matroska) holds. Throws Error.
GradientModel read_gradient_model(const std::filesystem::path& file);

/// Returns the effective configuration as YAML with a comment per key; read_config() reads the same values
/// back.
std::string write_config(const Config& config);

/// A range of frames of a log, counted from 0, both ends included.
struct FrameRange {
  std::int64_t first = 0, last = 0;
};

/// The input files and options that a user names on the command line.
struct LogInput {
  std::filesystem::path
      log{};  ///< recorded log, video, folder of images, or data folder of the public layout
  std::filesystem::path
      config{};  ///< empty: the one in the log, else config.yaml in or beside it, else the defaults
  /// The gradient model: nnmodel.pth or a log that contains one. If empty, it is the model that `config`
  /// names, else the one in the log, else the one that the log's configuration names.
  std::filesystem::path model{};
  std::filesystem::path background{};  ///< an image; empty: the log's first frames
  bool force = false;                  ///< Continue although the background frames seem to show contact.
  /// Frames that show the gel without contact. Earlier frames are left out.
  std::optional<FrameRange> background_frames = {};
  bool cropped = false;            ///< Sets SensorProfile::cropped, whatever the configuration says.
  bool counts_from_start = false;  ///< SensorProfile::counts_from_start
  int track = 0;                   ///< Replaces SensorProfile::video_track where it is not 0.
};

/// Adds the settings of a run for a log that continues this run, or for a camera that is localized in its map
/// (if `run` is not empty). The configuration is that of the run, unless `input` names another one. A model
/// that the log contains is kept, so that a log of another sensor is refused. Throws Error when there is no
/// such folder.
LogInput with_settings_of_run(LogInput input, const std::filesystem::path& run);

/// Reads the configuration that `input` names and resolves the path of the model. Throws Error.
Config resolve_config(const LogInput& input);

/// The same where no model is needed, or where there is no log yet (`input.log` is empty when frames will
/// come from a camera).
Config find_config(const LogInput& input);

struct LogAttachments;
/// Returns what is attached to a log that is recorded with this configuration, so that the log can be
/// reconstructed on any computer: the configuration and the model's file (or the model of the log that it
/// names). Throws Error when the model cannot be read.
LogAttachments attachments_of(const Config& config);

}  // namespace gelslam
