#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/slam/session.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;

TrackStatus status_from(const std::string& word) {
  for (const TrackStatus status : {TrackStatus::background, TrackStatus::no_contact, TrackStatus::tracked,
                                   TrackStatus::lost, TrackStatus::undone})
    if (name(status) == word) return status;
  throw Error("unknown status of a frame");
}

FrameRecord frame_from(const Json& json) {
  FrameRecord frame;
  frame.frame = integer_from(json.at(0), std::int64_t{0}, kMaxFrame);
  frame.time_s = number_from(json.at(1), kMaxTimeS);
  frame.status = status_from(json.at(2).get<std::string>());
  frame.keyframe = integer_from(json.at(4), -1, kMaxKeyframeId);
  frame.trial = integer_from(json.at(3), frame.keyframe < 0 ? -1 : 0, kMaxTrial);
  if (frame.keyframe >= 0) frame.keyframe_T_frame = pose_from(json.at(5));
  if (json.size() > 6) json.at(6).get_to(frame.observable);
  return frame;
}

/// One of those that came with this keyframe.
PoseGraphEdge edge_to(int keyframe, const Json& json, EdgeKind kind) {
  const PoseGraphEdge edge = edge_from(json);
  if (edge.to != keyframe || edge.kind != kind) throw Error("an edge of another keyframe");
  return edge;
}

/// Takes the lines in, one after the other.
class ScanReader {
 public:
  ScanReader(fs::path folder, const NormalFlowOptions& registration)
      : folder_(std::move(folder)), registration_(registration) {}

  /// Throws Error or a JSON exception for what no scan holds.
  void take(const Json& line) {
    if (line.contains("version")) {
      version_ = integer_from(line.at("version"), 0, std::numeric_limits<int>::max());
    } else if (line.contains("part")) {
      take_part(line.at("part"));
    } else if (line.contains("keyframe")) {
      take_keyframe(line);
    } else if (line.contains("loops_of")) {
      take_loops(line);
    } else if (line.contains("frames")) {
      take_frames(line.at("frames"));
    } else if (line.contains("forget_from_trial")) {
      forget_from_trial(integer_from(line.at("forget_from_trial"), 0, kMaxTrial));
    }
  }

  bool is_scan() const { return version_ || !record_.parts.empty() || !record_.keyframes.empty(); }
  std::optional<int> version() const { return version_; }  ///< none where its line is damaged
  bool is_of_several_models() const { return is_of_several_models_; }

  /// Leaves out what is linked to keyframes that are not there.
  ScanRecord finish(int damaged_lines) {
    for (auto& [id, edges] : edges_)
      for (PoseGraphEdge& edge : edges)
        if (record_.has_keyframe(edge.from) && record_.has_keyframe(edge.to)) record_.edges.push_back(edge);
    for (FrameRecord& frame : record_.frames)
      if (!record_.has_keyframe(frame.keyframe)) frame.keyframe = -1;
    add_missing_frames();
    if (record_.parts.empty() && !record_.keyframes.empty())
      record_.warnings.push_back((folder_ / "scan.jsonl").string() + ": does not say which sensor and model");
    if (damaged_lines > 0)
      record_.warnings.push_back(
          fmt::format("{}: {} damaged and left out", (folder_ / "scan.jsonl").string(),
                      damaged_lines == 1 ? "1 line is" : fmt::format("{} lines are", damaged_lines)));
    if (!unreadable_.empty())
      record_.warnings.push_back(fmt::format("{} of {} cannot be used: {}",
                                             counted(unreadable_count_, "keyframe"), folder_.string(),
                                             unreadable_));
    return std::move(record_);
  }

 private:
  /// Makes its place in the list: an id that was given is never free again, whatever became of the keyframe.
  std::size_t place_of(int id) {
    const auto place = static_cast<std::size_t>(id);
    if (place >= record_.keyframes.size()) {
      record_.keyframes.resize(place + 1);
      record_.searched.resize(place + 1);
    }
    return place;
  }

  /// A kill may come between a keyframe and the line that holds its frame.
  void add_missing_frames() {
    std::vector<FrameRecord>& frames = record_.frames;
    std::stable_sort(frames.begin(), frames.end(), by_frame);
    const auto same = [](const FrameRecord& a, const FrameRecord& b) { return a.frame == b.frame; };
    frames.erase(std::unique(frames.begin(), frames.end(), same), frames.end());
    const double frame_s =
        frames.size() < 2
            ? 0.0
            : (frames.back().time_s - frames.front().time_s) /
                  static_cast<double>(std::max<std::int64_t>(1, frames.back().frame - frames.front().frame));
    for (const auto& keyframe : record_.keyframes) {
      if (!keyframe) continue;
      FrameRecord missing{keyframe->frame, 0, TrackStatus::tracked, keyframe->trial, keyframe->id,
                          Pose::Identity()};
      const auto next = std::lower_bound(frames.begin(), frames.end(), missing, by_frame);
      if (next != frames.end() && next->frame == keyframe->frame) continue;
      if (next != frames.begin())
        missing.time_s =
            std::prev(next)->time_s + frame_s * static_cast<double>(missing.frame - std::prev(next)->frame);
      frames.insert(next, missing);
    }
  }

  static bool by_frame(const FrameRecord& a, const FrameRecord& b) { return a.frame < b.frame; }

  void take_part(const Json& json) {
    const std::int64_t after = record_.parts.empty() ? 0 : record_.parts.back().first_frame;
    record_.parts.push_back({integer_from(json.at("first_frame"), after, kMaxFrame),
                             json.at("sensor").get<std::string>(),
                             json.at("model_crc32").get<std::uint32_t>(), json.at("log").get<std::string>()});
    if (record_.parts.back().model_crc32 == 0) is_of_several_models_ = true;
  }

  void take_keyframe(const Json& line) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = integer_from(line.at("keyframe"), 0, kMaxKeyframeId);
    keyframe->frame = integer_from(line.at("frame"), std::int64_t{0}, kMaxFrame);
    keyframe->trial = integer_from(line.at("trial"), 0, kMaxTrial);
    const std::size_t id = place_of(keyframe->id);
    if (keyframe->id <= newest_) throw Error("keyframe ids do not ascend");
    newest_ = keyframe->id;
    const std::optional<PoseGraphEdge> link =
        line.at("link").is_null() ? std::nullopt
                                  : std::optional(edge_to(keyframe->id, line.at("link"), EdgeKind::odometry));
    try {
      keyframe->surface = StoredSurface(read_packed_surface(surface_file(folder_, keyframe->id)));
    } catch (const Error& error) {
      if (unreadable_count_++ == 0) unreadable_ = error.what();
      return;
    }
    keyframe->reference = StoredReference(keyframe->surface, registration_);
    if (link) edges_[keyframe->id].push_back(*link);
    record_.keyframes[id] = std::move(keyframe);
  }

  void take_loops(const Json& line) {
    const int id = integer_from(line.at("loops_of"), 0, kMaxKeyframeId);
    std::vector<PoseGraphEdge> loops;
    for (const Json& edge : line.at("edges")) loops.push_back(edge_to(id, edge, EdgeKind::loop));
    const std::size_t place = place_of(id);
    if (!record_.has_keyframe(id)) return;
    record_.searched[place] = true;
    std::vector<PoseGraphEdge>& edges = edges_[id];
    edges.insert(edges.end(), loops.begin(), loops.end());
  }

  void take_frames(const Json& list) {
    std::vector<FrameRecord> frames;
    for (const Json& frame : list) frames.push_back(frame_from(frame));
    for (const FrameRecord& frame : frames)
      if (frame.keyframe >= 0) place_of(frame.keyframe);
    record_.frames.insert(record_.frames.end(), frames.begin(), frames.end());
  }

  void forget_from_trial(int trial) {
    for (auto& keyframe : record_.keyframes)
      if (keyframe && keyframe->trial >= trial) keyframe.reset();
    for (FrameRecord& frame : record_.frames) {
      if (frame.keyframe < 0 || frame.trial < trial) continue;
      frame.status = TrackStatus::undone;
      frame.keyframe = -1;
    }
  }

  const fs::path folder_;
  const NormalFlowOptions registration_;
  std::optional<int> version_;
  bool is_of_several_models_ = false;
  int newest_ = -1;  // keyframe that a line was about
  ScanRecord record_;
  std::map<int, std::vector<PoseGraphEdge>> edges_;  // by the newer keyframe
  int unreadable_count_ = 0;
  std::string unreadable_;  // why the first of them is
};

}  // namespace

PackedSurface read_packed_surface(const fs::path& file) {
  std::string bytes = read_file(file);
  try {
    return PackedSurface::from_bytes(std::move(bytes));
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
}

ScanRecord read_scan(const fs::path& folder, const NormalFlowOptions& registration) {
  check_run_files(folder);
  const fs::path file = folder / "scan.jsonl";
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + ": cannot be read; only a run of version 0.3 or newer holds one");
  ScanReader reader(folder, registration);
  int damaged = 0;
  for (std::string line; std::getline(stream, line);) {
    const std::optional<Json> whole = without_damage(line);
    const bool is_cut_off = !whole && stream.eof();  // by a kill
    if (!whole && !is_cut_off && !line.empty()) ++damaged;
    if (!whole) continue;
    try {
      reader.take(*whole);
    } catch (const std::exception&) {
      ++damaged;
    }
  }
  if (!reader.is_scan()) throw Error(file.string() + ": damaged, or not a scan of gelslam");
  try {
    if (reader.version()) check_session_version(*reader.version());
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
  if (reader.is_of_several_models())
    throw Error(
        file.string() +
        ": holds surfaces of several sensors or models, which older versions joined; reconstruct each "
        "log alone");
  return reader.finish(damaged);
}

}  // namespace gelslam
