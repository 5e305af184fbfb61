#include "gelslam/slam/continue_scan.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <map>
#include <set>

#include "gelslam/core/error.hpp"
#include "gelslam/core/folder_lock.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

std::uint32_t crc32_of(const GradientModel& model) {
  return static_cast<std::uint32_t>(::crc32(0, reinterpret_cast<const Bytef*>(model.numbers.data()),
                                            static_cast<uInt>(sizeof model.numbers)));
}

void check_same_sensor(const fs::path& run, const ScanRecord& record, const ScanPart& part,
                       const SensorProfile& sensor) {
  const std::string what_to_do = "; reconstruct the new log alone, then join both with gelslam merge";
  if (!record.parts.empty() && record.parts.back().model_crc32 != part.model_crc32)
    throw Error(run.string() + ": was scanned with another gradient model" + what_to_do);
  const auto last = std::find_if(record.keyframes.rbegin(), record.keyframes.rend(),
                                 [](const auto& keyframe) { return keyframe != nullptr; });
  if (last == record.keyframes.rend()) return;
  if (record.parts.empty())
    throw Error(run.string() + ": does not say by which gradient model it was scanned" + what_to_do);
  const StoredSurface& surface = (*last)->surface;
  if (surface.size() != cv::Size(sensor.width_px, sensor.height_px) ||
      surface.pixel_pitch_mm() != sensor.pixel_pitch_mm)
    throw Error(fmt::format(
        "{}: was scanned at {} pixels of {} mm, not at {} pixels of {} mm{}", run.string(),
        size_text(surface.size().width, surface.size().height), short_number(surface.pixel_pitch_mm()),
        size_text(sensor.width_px, sensor.height_px), short_number(sensor.pixel_pitch_mm), what_to_do));
}

/// Index of the part that a frame belongs to.
std::size_t part_of_frame(const std::vector<ScanPart>& parts, std::int64_t frame) {
  const auto next = std::upper_bound(parts.begin(), parts.end(), frame,
                                     [](std::int64_t f, const ScanPart& p) { return f < p.first_frame; });
  return next == parts.begin() ? 0 : static_cast<std::size_t>(next - parts.begin()) - 1;
}

struct Joined {
  std::set<int> trials, trials_in_map;
  std::int64_t frames = 0, frames_in_map = 0;
};

}  // namespace

int ContinuedScan::last_trial() const {
  int trial = -1;
  for (const FrameRecord& frame : record.frames) trial = std::max(trial, frame.trial);
  for (const auto& keyframe : record.keyframes)
    if (keyframe) trial = std::max(trial, keyframe->trial);
  return trial;
}

ScanPart part_of(const Config& config, const fs::path& log) {
  const fs::path& model = config.sensor.calibration_model_path;
  return {0, config.sensor.device_name, model.empty() ? 0 : crc32_of(read_gradient_model(model)),
          log.empty() ? "" : fs::absolute(log).lexically_normal().string()};
}

ContinuedScan continue_scan(const fs::path& run, const Config& config, const fs::path& log) {
  std::error_code code;
  if (!fs::is_directory(run, code)) throw Error(run.string() + ": no such run folder");
  ContinuedScan scan;
  scan.record = read_scan(run / "session", config.slam.registration);
  ScanPart part = part_of(config, log);
  check_same_sensor(run, scan.record, part, config.sensor);
  if (!scan.record.frames.empty()) {
    scan.first_frame = scan.record.frames.back().frame + 1;
    scan.first_time_s = scan.record.frames.back().time_s + kBetweenParts_s;
  }
  part.first_frame = scan.first_frame;
  scan.record.parts.push_back(std::move(part));
  return scan;
}

ContinuedScan continue_in_place(const fs::path& run, const Config& config) {
  std::error_code code;
  const bool is_there = fs::is_directory(run, code);  // else continue_scan() throws
  auto lock = is_there ? std::make_shared<const FolderLock>(run) : nullptr;
  ContinuedScan scan = continue_scan(run, config, "");
  scan.lock = std::move(lock);
  return scan;
}

std::vector<std::string> describe_parts(const SlamMap& map) {
  const std::vector<ScanPart>& parts = map.measured.parts;
  if (parts.size() < 2) return {};
  std::vector<Joined> joined(parts.size());
  for (const FrameRecord& frame : map.frames) {
    if (frame.keyframe < 0) continue;
    Joined& part = joined[part_of_frame(parts, frame.frame)];
    part.trials.insert(frame.trial);
    ++part.frames;
    if (!map.has_pose(frame)) continue;
    part.trials_in_map.insert(frame.trial);
    ++part.frames_in_map;
  }
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Joined& part = joined[i];
    std::string line = fmt::format("part {} of {} ({}): ", i + 1, parts.size(),
                                   parts[i].log.empty() ? parts[i].sensor : parts[i].log);
    if (part.trials.empty())
      line += "never touched";
    else if (part.trials_in_map.empty())
      line += "did not join: no place of it was recognized in the map";
    else if (part.frames_in_map == part.frames)
      line += "joined, " + counted(part.frames, "frame");
    else
      line += fmt::format("{} of {} joined, {} of {}", part.trials_in_map.size(),
                          counted(static_cast<std::int64_t>(part.trials.size()), "trial"), part.frames_in_map,
                          counted(part.frames, "frame"));
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace gelslam
