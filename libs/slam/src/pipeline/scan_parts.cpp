#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "gelslam/core/text.hpp"
#include "gelslam/slam/continue_scan.hpp"

namespace gelslam {

std::size_t part_of_frame(const std::vector<ScanPart>& parts, std::int64_t frame) {
  const auto next = std::upper_bound(parts.begin(), parts.end(), frame,
                                     [](std::int64_t f, const ScanPart& p) { return f < p.first_frame; });
  return next == parts.begin() ? 0 : static_cast<std::size_t>(next - parts.begin()) - 1;
}

int ScanRecord::last_trial() const {
  int trial = -1;
  for (const FrameRecord& frame : frames) trial = std::max(trial, frame.trial);
  for (const auto& keyframe : keyframes)
    if (keyframe) trial = std::max(trial, keyframe->trial);
  return trial;
}

namespace {

struct Joined {
  std::set<int> trials, trials_in_map;
  std::int64_t frames = 0, frames_in_map = 0;
};

}  // namespace

std::vector<std::string> describe_parts(const SlamMap& map) {
  const std::vector<ScanPart>& parts = map.parts;
  if (parts.size() < 2) return {};
  std::vector<Joined> joined(parts.size());
  for (const FrameRecord& frame : map.frames) {
    if (frame.status != TrackStatus::tracked) continue;
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
