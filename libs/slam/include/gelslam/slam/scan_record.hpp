#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/frontend/tracker.hpp"

namespace gelslam {

/// What a record can hold, in either direction: later times are milliseconds.
inline constexpr double kMaxTimeS = 1e12;

/// How long a scan can be: a day at 30 Hz, whose records take 1.3 GB. GelSlam ends there, and a session that
/// has more is not read.
inline constexpr int kMaxScanFrames = 24 * 3600 * 30;

/// Times go on from part to part: a new one begins this long after the last frame.
inline constexpr double kBetweenPartsS = 1.0;

/// The result of tracking one frame: small enough to keep one per frame of a long log.
struct FrameRecord {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;
  int keyframe = -1;  ///< id; -1 without contact
  Pose keyframe_T_frame = Pose::Identity();
  /// RegistrationResult::observable of a tracked frame; true where none was asked.
  std::array<bool, 6> observable = {true, true, true, true, true, true};
  std::int64_t unix_us = 0;  ///< when it was captured, by the system's clock; 0: not known
  // Of the registration to the keyframe, as those of an edge; 0 where the frame is that keyframe.
  Matrix6d covariance = Matrix6d::Zero();
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();

  UncertainMotion keyframe_T_frame_measured() const;
};

FrameRecord record_of(const TrackedFrame& tracked);

/// An unbroken recording: one log, or one live scan.
struct ScanPart {
  std::int64_t first_frame = 0;  ///< frames are counted on from part to part
  std::string sensor;            ///< its name
  /// CRC-32 of the gradient model's numbers: only surfaces read by one model share a gradient scale.
  std::uint32_t model_crc32 = 0;
  std::string log;  ///< file; empty where none was kept
};

/// Index of the part that a frame belongs to; 0 without parts.
std::size_t part_of_frame(const std::vector<ScanPart>& parts, std::int64_t frame);

/// All that a scan has measured, and so all that is needed to continue it: what tracking and loop closure
/// found, before the pose graph draws conclusions.
struct ScanRecord {
  std::vector<ScanPart> parts = {};  ///< by first_frame
  /// By id, as many as ids were given; null where taken back.
  std::vector<std::shared_ptr<const Keyframe>> keyframes = {};
  /// Keyframe by keyframe: the link to the keyframe it was tracked from, then its loops.
  std::vector<PoseGraphEdge> edges = {};
  std::vector<bool> searched = {};  ///< by id: loops were looked for; never those of a patch
  std::vector<FrameRecord> frames = {};

  bool has_keyframe(int id) const {
    return id >= 0 && id < static_cast<int>(keyframes.size()) && keyframes[static_cast<std::size_t>(id)];
  }
  int last_keyframe() const { return static_cast<int>(keyframes.size()) - 1; }
  int last_trial() const;
  // Of the first frame of a part that follows.
  std::int64_t next_frame() const { return frames.empty() ? 0 : frames.back().frame + 1; }
  double next_time_s() const { return frames.empty() ? 0 : frames.back().time_s + kBetweenPartsS; }
  /// Unix time in microseconds at which `time_s` is 0, if every frame knows its own and they increase.
  std::optional<std::int64_t> start_unix_us() const;
  /// Of every frame, as trajectories have it: Unix time, or `time_s` where start_unix_us() is not known.
  std::vector<double> stamps_s() const;
};

}  // namespace gelslam
