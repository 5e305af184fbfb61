#include "run_folder/scan_writer.hpp"

#include <map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFramesPerLine = 25;  // about one second: as much as a kill may cost

Json json_of(const FrameRecord& frame) {
  Json values = {frame.frame, frame.time_s, name(frame.status), frame.trial, frame.keyframe};
  if (frame.keyframe < 0) return values;
  values.push_back(numbers(frame.keyframe_T_frame));
  if (frame.observable != FrameRecord().observable) values.push_back(frame.observable);
  return values;
}

/// Edges by the keyframe that they came with.
std::map<int, std::vector<PoseGraphEdge>> by_newer_keyframe(const std::vector<PoseGraphEdge>& edges) {
  std::map<int, std::vector<PoseGraphEdge>> of_keyframe;
  for (const PoseGraphEdge& edge : edges) of_keyframe[edge.to].push_back(edge);
  return of_keyframe;
}

void write_keyframe(ScanWriter& writer, const Keyframe& keyframe, const std::vector<PoseGraphEdge>& edges,
                    bool searched) {
  const bool is_linked = !edges.empty() && edges.front().kind == EdgeKind::odometry;
  writer.add_keyframe(keyframe, is_linked ? &edges.front() : nullptr);
  if (searched) writer.add_loops(keyframe.id, {edges.begin() + (is_linked ? 1 : 0), edges.end()});
}

}  // namespace

ScanWriter::ScanWriter(const fs::path& folder, int open_flags)
    : folder_(folder),
      file_(folder / "scan.jsonl"),
      record_(::open(file_.c_str(), O_RDWR | O_APPEND | O_NOFOLLOW | O_CLOEXEC | open_flags, 0666)) {
  if (!record_.ok()) throw Error(file_.string() + ": cannot be written: " + errno_text());
  const off_t size = ::lseek(record_.get(), 0, SEEK_END);
  char last = '\n';
  ends_within_line_ = size > 0 && ::pread(record_.get(), &last, 1, size - 1) == 1 && last != '\n';
}

ScanWriter ScanWriter::begin(const fs::path& folder) {
  std::error_code code;
  fs::remove_all(folder, code);
  if (!code) fs::create_directories(folder, code);
  if (code) throw Error(folder.string() + ": cannot create the folder: " + code.message());
  ScanWriter writer(folder, O_CREAT);
  sync_folder(folder);
  sync_folder(folder.parent_path());
  writer.write(with_checksum({{"version", kSessionVersion}}));
  return writer;
}

ScanWriter ScanWriter::append(const fs::path& folder) { return {folder, 0}; }

/// Line by line with one system call each: what was written survives a kill.
void ScanWriter::write(const std::string& line) {
  const std::string bytes = (ends_within_line_ ? "\n" : "") + line;
  const ssize_t written = ::write(record_.get(), bytes.data(), bytes.size());
  if (written > 0) ends_within_line_ = written != static_cast<ssize_t>(bytes.size());
  if (written == static_cast<ssize_t>(bytes.size())) return;
  if (written >= 0) errno = ENOSPC;
  throw Error(file_.string() + ": cannot be written: " + errno_text());
}

/// Not every file system can.
void ScanWriter::sync() const {
  if (::fdatasync(record_.get()) != 0 && errno != EINVAL && errno != ENOSYS)
    throw Error(file_.string() + ": cannot be written: " + errno_text());
}

void ScanWriter::add_part(const ScanPart& part) {
  write_waiting();
  write(with_checksum({{"part",
                        {{"first_frame", part.first_frame},
                         {"sensor", part.sensor},
                         {"model_crc32", part.model_crc32},
                         {"log", part.log}}}}));
}

void ScanWriter::add_keyframe(const Keyframe& keyframe, const PoseGraphEdge* link) {
  write_waiting();
  if (!leads_to(file_, record_)) throw Error(file_.string() + ": was moved or replaced during the scan");
  write_file_atomically(surface_file(folder_, keyframe.id), keyframe.surface.packed()->bytes());
  write(with_checksum({{"keyframe", keyframe.id},
                       {"frame", keyframe.frame},
                       {"trial", keyframe.trial},
                       {"link", link ? slam::detail::json_of(*link) : Json()}}));
  sync();
}

void ScanWriter::add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops) {
  Json edges = Json::array();
  for (const PoseGraphEdge& loop : loops) edges.push_back(slam::detail::json_of(loop));
  write(with_checksum({{"loops_of", keyframe}, {"edges", edges}}));
}

void ScanWriter::add_frame(const FrameRecord& frame) {
  waiting_.push_back(frame);
  if (waiting_.size() >= kFramesPerLine) write_waiting();
}

void ScanWriter::forget_from_trial(int trial) {
  write_waiting();
  write(with_checksum({{"forget_from_trial", trial}}));
}

void ScanWriter::flush() {
  write_waiting();
  sync();
}

void ScanWriter::write_waiting() {
  if (waiting_.empty()) return;
  Json frames = Json::array();
  for (const FrameRecord& frame : waiting_) frames.push_back(json_of(frame));
  waiting_.clear();  // also when the disk is full: they are not tried for ever
  write(with_checksum({{"frames", frames}}));
}

void write_scan(const fs::path& folder, const ScanRecord& record) {
  ScanWriter writer = ScanWriter::begin(folder);
  for (const ScanPart& part : record.parts) writer.add_part(part);
  const auto edges = by_newer_keyframe(record.edges);
  for (std::size_t id = 0; id < record.keyframes.size(); ++id) {
    if (!record.keyframes[id]) continue;
    const auto of_this = edges.find(static_cast<int>(id));
    write_keyframe(writer, *record.keyframes[id],
                   of_this == edges.end() ? std::vector<PoseGraphEdge>() : of_this->second,
                   id < record.searched.size() && record.searched[id]);
  }
  for (const FrameRecord& frame : record.frames) writer.add_frame(frame);
  writer.flush();
}

}  // namespace gelslam
