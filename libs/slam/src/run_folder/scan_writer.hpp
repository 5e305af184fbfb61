#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// Writes a record while the scan goes on: session/scan.jsonl grows line by line, each with its checksum, and
/// every keyframe's surface gets a file of its own. After kill -9 what was written is there; after a power
/// loss, what was written up to the last keyframe. Not thread-safe. Its functions throw Error when the disk
/// is full or the folder may not be written.
class ScanWriter {
 public:
  /// Begins the record of a new scan; what the folder held of another one is removed.
  static ScanWriter begin(const std::filesystem::path& folder);
  /// Goes on with the one that is there.
  static ScanWriter append(const std::filesystem::path& folder);

  void add_part(const ScanPart& part);
  /// `link`: null at the start of a trial.
  void add_keyframe(const Keyframe& keyframe, const PoseGraphEdge* link);
  /// The loops of a keyframe; to be called for every one, also if none were found.
  void add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops);
  void add_frame(const FrameRecord& frame);  ///< is written with the next line, or the next 25th frame
  void forget_from_trial(int trial);         ///< Mapper::forget_from_trial(); its frames become `undone`
  void flush();                              ///< writes frames that wait; then all is on the disk

 private:
  ScanWriter(const std::filesystem::path& folder, int open_flags);
  void write(const std::string& line);
  void write_waiting();
  void sync() const;

  std::filesystem::path folder_, file_;
  FileDescriptor record_;
  bool ends_within_line_ = false;  // cut off by a kill or a full disk
  std::vector<FrameRecord> waiting_;
};

/// Writes a whole record at once.
void write_scan(const std::filesystem::path& folder, const ScanRecord& record);

}  // namespace gelslam
