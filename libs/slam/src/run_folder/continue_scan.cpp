#include "gelslam/slam/continue_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

std::uint32_t crc32_of_numbers(const GradientModel& model) {
  const std::span<const float> network =
      model.wide ? std::span<const float>(model.wide->numbers) : model.numbers;
  std::vector<float> numbers(network.begin(), network.end());
  numbers.insert(numbers.end(), model.slope_matrix.begin(), model.slope_matrix.end());
  return crc32_of({reinterpret_cast<const char*>(numbers.data()), sizeof(float) * numbers.size()});
}

}  // namespace

void check_same_sensor(const fs::path& run, const ScanRecord& record, const ScanPart& part,
                       const SensorProfile& sensor) {
  const std::string result = "; scans of different sensors or models stay apart";
  if (record.parts.back().model_crc32 != part.model_crc32)
    throw Error(run.string() + ": was scanned with another gradient model" + result);
  const auto last = std::find_if(record.keyframes.rbegin(), record.keyframes.rend(),
                                 [](const auto& keyframe) { return keyframe != nullptr; });
  if (last == record.keyframes.rend()) return;
  const SurfaceFacts surface = (*last)->surface.facts();
  if (surface.size != cv::Size(sensor.width_px, sensor.height_px) ||
      surface.pixel_pitch_mm != sensor.pixel_pitch_mm)
    throw Error(fmt::format(
        "{}: was scanned at {} pixels of {} mm, not at {} pixels of {} mm{}", run.string(),
        size_text(surface.size.width, surface.size.height), short_number(surface.pixel_pitch_mm),
        size_text(sensor.width_px, sensor.height_px), short_number(sensor.pixel_pitch_mm), result));
}

ScanPart part_of(const Config& config, const fs::path& log) {
  const fs::path& model = config.sensor.calibration_model_path;
  return {0, config.sensor.device_name, model.empty() ? 0 : crc32_of_numbers(read_gradient_model(model)),
          log.empty() ? "" : fs::absolute(log).lexically_normal().string()};
}

ScanRecord continue_scan(const fs::path& run, const Config& config, const fs::path& log) {
  check_is_run(run, RunNeeds::record);
  ScanRecord record = read_scan(run, config.slam.registration);
  ScanPart part = part_of(config, log);
  check_same_sensor(run, record, part, config.sensor);
  part.first_frame = record.next_frame();
  record.parts.push_back(std::move(part));
  return record;
}

ContinuedScan continue_in_place(const fs::path& run, const Config& config) {
  auto lock = std::make_shared<const FolderLock>(run);
  return {continue_scan(run, config, ""), std::move(lock)};
}

}  // namespace gelslam
