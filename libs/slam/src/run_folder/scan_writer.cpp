#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <set>

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFramesPerLine = 25;  // about one second: as much as a kill may cost

/// Written when a line was cut off, so that the next one is whole.
bool ends_within_line(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream || stream.tellg() == std::streampos(0)) return false;
  stream.seekg(-1, std::ios::end);
  return stream.get() != '\n';
}

Json json_of(const FrameRecord& frame) {
  Json values = {frame.frame, frame.time_s, name(frame.status), frame.trial, frame.keyframe};
  if (frame.keyframe >= 0) values.push_back(numbers(frame.keyframe_T_frame));
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

ScanWriter ScanWriter::begin(const fs::path& folder) {
  std::error_code code;
  fs::remove_all(folder, code);
  if (!code) fs::create_directories(folder, code);
  if (code) throw Error(folder.string() + ": cannot create the folder: " + code.message());
  ScanWriter writer(folder);
  writer.write(with_checksum({{"version", kSessionVersion}}));
  return writer;
}

ScanWriter ScanWriter::append(const fs::path& folder) {
  if (!fs::exists(folder / "scan.jsonl")) throw Error(folder.string() + ": holds no scan.jsonl");
  return ScanWriter(folder);
}

/// Line by line with one system call each: what was written survives a kill.
void ScanWriter::write(const std::string& line) {
  const fs::path file = folder_ / "scan.jsonl";
  const std::string bytes = (ends_within_line(file) ? "\n" : "") + line;
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const ssize_t written = descriptor < 0 ? -1 : ::write(descriptor, bytes.data(), bytes.size());
  const int error = written < 0 ? errno : ENOSPC;
  if (descriptor >= 0) ::close(descriptor);
  if (written != static_cast<ssize_t>(bytes.size()))
    throw Error(file.string() + ": cannot be written: " + std::strerror(error));
}

void ScanWriter::add_part(const ScanPart& part) {
  flush();
  write(with_checksum({{"part",
                        {{"first_frame", part.first_frame},
                         {"sensor", part.sensor},
                         {"model_crc32", part.model_crc32},
                         {"log", part.log}}}}));
}

void ScanWriter::add_keyframe(const Keyframe& keyframe, const PoseGraphEdge* link) {
  flush();
  write_file_atomically(surface_file(folder_, keyframe.id), keyframe.surface.packed()->bytes());
  write(with_checksum({{"keyframe", keyframe.id},
                       {"frame", keyframe.frame},
                       {"trial", keyframe.trial},
                       {"link", link ? slam::detail::json_of(*link) : Json()}}));
}

void ScanWriter::add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops) {
  Json edges = Json::array();
  for (const PoseGraphEdge& loop : loops) edges.push_back(slam::detail::json_of(loop));
  write(with_checksum({{"loops_of", keyframe}, {"edges", edges}}));
}

void ScanWriter::add_frame(const FrameRecord& frame) {
  waiting_.push_back(frame);
  if (waiting_.size() >= kFramesPerLine) flush();
}

void ScanWriter::forget_from_trial(int trial) {
  flush();
  write(with_checksum({{"forget_from_trial", trial}}));
}

void ScanWriter::flush() {
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
