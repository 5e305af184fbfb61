#pragma once

#include <filesystem>
#include <string>

#include "gelslam/core/sensor_optics.hpp"

namespace gelslam {

/// Optics of a GelSight Mini for images 20.3 mm wide. k comes from the printed dots of four sensors, minus
/// the effect of the dome; the distance from 157 dots under pressed balls; the dome from the bare gel of five
/// sensors.
inline constexpr SensorOptics kGelSightMiniOptics{0.037, {0, 0}, 1, 22, {0.0017, 0.0028}};

/// Fixed properties of a sensor (device_config in the public YAML). Defaults: GelSight Mini without markers.
struct SensorProfile {
  std::string device_name = "GelSight Mini";
  /// `ppmm` in the public files: millimeters per pixel after crop and resize
  double pixel_pitch_mm = 0.0634;
  int width_px = 320;        ///< `imgw`
  int height_px = 240;       ///< `imgh`
  int raw_width_px = 3280;   ///< `raw_imgw`, camera image before the crop
  int raw_height_px = 2464;  ///< `raw_imgh`
  /// Images that have neither the size `imgw` x `imgh` nor `raw_imgw` x `raw_imgh` have already been cropped,
  /// and are only resized.
  bool cropped = false;
  /// Track of a video with several, counted from 1; 0: the first one, with a warning.
  int video_track = 0;
  double frame_rate_hz = 25.0;         ///< `framerate`: requested from a camera; used for logs without times.
  std::string camera = "auto";         ///< a path, part of the camera's name, or "auto": see camera.hpp
  std::string camera_format = "MJPG";  ///< MJPG or YUYV, at the raw size
  std::string camera_controls;         ///< "exposure_time_absolute=120, gain=3"
  bool counts_from_start = false;      ///< Ignore the times of images on the system's clock; not in the file.
  std::filesystem::path calibration_model_path;  ///< absolute (or a log that holds the model), or empty if
                                                 ///< the config names none
};

}  // namespace gelslam
