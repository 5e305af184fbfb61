#include "data_files.hpp"

#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

#include "gelslam/core/error.hpp"
#include "gelslam/image/encoders.hpp"

namespace gelslam::simulation::detail {

void make_folder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw Error("cannot make folder " + folder.string() + ": " + failure.message());
}

std::vector<std::uint8_t> encode_frame(const cv::Mat3b& bgr, bool lossless) {
  return lossless ? encode_png(bgr) : encode_jpeg(bgr);
}

std::string config_yaml(const std::filesystem::path& folder, const SensorGeometry& geometry,
                        double frame_rate_hz, const std::filesystem::path& model) {
  std::ostringstream yaml;
  yaml << "# Configuration of the Device\ndevice_config:\n  device_name: \"GelSight Mini\"\n  ppmm: "
       << geometry.pixel_pitch_mm << "\n  imgh: " << geometry.height_px << "\n  imgw: " << geometry.width_px
       << "\n  raw_imgh: 2464\n  raw_imgw: 3280\n  framerate: " << frame_rate_hz << "\n";
  if (!model.empty()) {
    const std::filesystem::path there = std::filesystem::absolute(model).lexically_normal();
    const std::filesystem::path here = std::filesystem::absolute(folder).lexically_normal();
    yaml << "  calibration_model_path: " << nlohmann::json(there.lexically_relative(here).string()).dump()
         << "\n";
  }
  yaml << "contact_mask_config:\n  color_dist_threshold: 15\n  height_threshold: 0.2\n"
          "gelslam_config:\n  track_config:\n    contact_threshold: 500\n    scr_threshold: 0.3\n    "
          "ccs_threshold: 0.7\n"
          "  pose_graph_config:\n    coverage_graph_overlap_threshold: 50\n    min_sift_inliers: 8\n"
          "    scr_threshold: 0.3\n    ccs_threshold: 0.7\n";
  return yaml.str();
}

}  // namespace gelslam::simulation::detail
