#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

fs::path config_beside(const fs::path& log) {
  const fs::path folder = fs::is_directory(log) ? log : log.parent_path();
  const fs::path file = folder / "config.yaml";
  return fs::is_regular_file(file) ? file : fs::path();
}

struct FoundConfig {
  Config config;
  std::string from;  ///< file, or "" for the defaults
};

FoundConfig found_config(const fs::path& file) {
  return {file.empty() ? Config{} : read_config(file), file.string()};
}

FoundConfig config_of_log(const LogInput& input) {
  if (!fs::exists(input.log) && !is_matroska(input.log))
    throw Error(input.log.string() + ": no such file or folder");
  const LogAttachments stored = is_matroska(input.log) ? read_log_attachments(input.log) : LogAttachments{};
  const std::string stored_name = input.log.string() + "[config.yaml]";
  const bool as_recorded = input.config.empty() && !stored.config_yaml.empty();
  FoundConfig found = as_recorded
                          ? FoundConfig{read_config_text(stored.config_yaml, stored_name), stored_name}
                          : found_config(input.config.empty() ? config_beside(input.log) : input.config);
  fs::path& model = found.config.sensor.calibration_model_path;
  const bool named_by_person = !input.config.empty() && !model.empty();
  if (!stored.model.empty() && !named_by_person) model = fs::absolute(input.log);
  return found;
}

/// Returns the optics of a GelSight Mini. If the image is narrower than the one in which they were measured,
/// the distortion at its border is smaller.
SensorOptics mini_optics(const SensorProfile& sensor) {
  const SensorProfile mini;
  const double width = sensor.width_px * sensor.pixel_pitch_mm / (mini.width_px * mini.pixel_pitch_mm);
  SensorOptics optics = kGelSightMiniOptics;
  optics.lens_k1 *= width * width;
  return optics;
}

/// Completes the configuration if it contains no optics.
void add_optics(const LogInput& input, Config& config) {
  if (config.optics_from != "default") return;
  const fs::path folder = fs::is_directory(input.log) ? input.log : input.log.parent_path();
  if (const auto optics = input.log.empty() ? std::nullopt : find_optics(folder / kOpticsFileName)) {
    config.surface.optics = *optics;
    config.optics_from = "log";
  } else if (config.sensor.device_name.find("GelSight Mini") != std::string::npos) {
    config.surface.optics = mini_optics(config.sensor);
    config.optics_from = "GelSight Mini";
  }
}

FoundConfig look_up(const LogInput& input) {
  FoundConfig found = input.log.empty() ? found_config(input.config) : config_of_log(input);
  add_optics(input, found.config);
  found.config.sensor.cropped |= input.cropped;
  found.config.sensor.counts_from_start = input.counts_from_start;
  if (input.track > 0) found.config.sensor.video_track = input.track;
  if (!input.model.empty()) found.config.sensor.calibration_model_path = fs::absolute(input.model);
  return found;
}

std::string model_bytes(const fs::path& file) {
  if (is_matroska(file)) return read_log_attachments(file).model;
  return read_file(file);
}

}  // namespace

LogAttachments attachments_of(const Config& config) {
  LogAttachments attachments;
  Config stored = config;
  fs::path& model = stored.sensor.calibration_model_path;
  if (!model.empty()) {
    // The model is read here so that a broken model is found before the log is recorded. Its optics may come
    // from a file beside it.
    stored.surface.optics = read_gradient_model(model).optics.value_or(stored.surface.optics);
    attachments.model = model_bytes(model);
  }
  // The model is attached to the log itself, and paths of this computer have no meaning on another one.
  model.clear();
  attachments.config_yaml = write_config(stored);
  return attachments;
}

LogInput with_settings_of_run(LogInput input, const fs::path& run) {
  if (run.empty() || !input.config.empty()) return input;
  if (!fs::is_directory(run)) throw Error(run.string() + ": no such run folder");
  check_run_files(run);
  const fs::path config = run / "config.yaml";
  if (!fs::exists(config)) return input;
  input.config = config;
  if (input.model.empty() && is_matroska(input.log) && !read_log_attachments(input.log).model.empty())
    input.model = input.log;
  return input;
}

Config find_config(const LogInput& input) { return look_up(input).config; }

Config resolve_config(const LogInput& input) {
  FoundConfig found = look_up(input);
  if (const fs::path& model = found.config.sensor.calibration_model_path; !model.empty()) {
    if (const auto optics = read_gradient_model(model).optics) {
      found.config.surface.optics = *optics;
      found.config.optics_from = "model";
    }
    return found.config;
  }
  // Reported first if the file is no log at all.
  if (!input.log.empty()) open_frame_source(input.log, found.config.sensor)->next();
  throw Error("no gradient model: name one (nnmodel.pth), or calibration_model_path in " +
              (found.from.empty() ? std::string("a configuration") : found.from));
}

}  // namespace gelslam
