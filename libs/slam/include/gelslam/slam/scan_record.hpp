#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/tracker.hpp"

namespace gelslam {

class FolderLock;

/// The result of tracking one frame: small enough to keep one per frame of a long log.
struct FrameRecord {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;
  int keyframe = -1;  ///< id; -1 without contact
  Pose keyframe_T_frame = Pose::Identity();
};

FrameRecord record_of(const TrackedFrame& tracked);
FrameRecord background_record(std::int64_t frame, double time_s);

/// An unbroken recording: one log, or one live scan.
struct ScanPart {
  std::int64_t first_frame = 0;  ///< frames are counted on from part to part
  std::string sensor;            ///< its name
  /// Of the gradient model's numbers: only surfaces read by one model share a slope correction. 0: surfaces
  /// of several sensors, already corrected (merge).
  std::uint32_t model_crc32 = 0;
  std::string log;  ///< file; empty where none was kept
};

/// All that a scan has measured, and so all that is needed to continue it: what tracking and loop closure
/// found, before the pose graph draws conclusions.
struct ScanRecord {
  std::vector<ScanPart> parts;
  /// By id, as many as ids were given; null where taken back, or damaged.
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  /// Keyframe by keyframe: the link to the keyframe it was tracked from, then its loops.
  std::vector<PoseGraphEdge> edges;
  std::vector<bool> searched;  ///< by id: loops were looked for
  std::vector<FrameRecord> frames;
  std::vector<std::string> warnings;  ///< what could not be read, as sentences for the user
};

/// A scan that is to be continued, and the part that follows.
struct ContinuedScan {
  ScanRecord record;  ///< `parts` includes the new one
  std::int64_t first_frame = 0;
  double first_time_s = 0;                 ///< a second after the last frame
  std::shared_ptr<const FolderLock> lock;  ///< of the run folder, if the scan goes on in it

  int last_keyframe() const { return static_cast<int>(record.keyframes.size()) - 1; }
  int last_trial() const;
};

/// Writes a record while the scan goes on: session/scan.jsonl grows line by line, each with its checksum, and
/// every keyframe's surface gets a file of its own. After kill -9 what was written is there. Not thread-safe.
/// Its functions throw Error when the disk is full or the folder may not be written.
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
  void flush();                              ///< writes frames that wait

 private:
  explicit ScanWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void write(const std::string& line);

  std::filesystem::path folder_;
  std::vector<FrameRecord> waiting_;
};

/// Writes a whole record at once.
void write_scan(const std::filesystem::path& folder, const ScanRecord& record);

/// Reads a record, also one that a kill has cut off: a last line that is not whole is left out. Lines and
/// surfaces that are damaged or missing are left out with a warning. Throws Error when there is no record, or
/// it was written by a newer version.
ScanRecord read_scan(const std::filesystem::path& folder, const NormalFlowOptions& registration);

}  // namespace gelslam
