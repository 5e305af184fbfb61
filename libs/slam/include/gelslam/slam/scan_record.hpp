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

/// Largest absolute value of a time. Larger values are rejected, because they are usually milliseconds.
inline constexpr double kMaxTimeS = 1e12;

/// Maximum length of a scan: one day at 30 Hz, whose records take 1.3 GB. GelSlam ends there, and a session
/// with more frames is not read.
inline constexpr int kMaxScanFrames = 24 * 3600 * 30;

/// In a scan of several parts, time runs on: a part begins this long after the last frame of the part before.
inline constexpr double kBetweenPartsS = 1.0;

/// The tracking result that is stored for every frame; small enough for long logs.
struct FrameRecord {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;
  int keyframe = -1;  ///< id; -1 without contact
  Pose keyframe_T_frame = Pose::Identity();
  /// RegistrationResult::observable for a tracked frame; all true for others.
  std::array<bool, 6> observable = {true, true, true, true, true, true};
  std::int64_t unix_us = 0;  ///< Time of capture by the system's clock; 0 if not known.
  // Covariance and center of the registration to the keyframe, as for an edge; 0 if the frame is the
  // keyframe.
  Matrix6d covariance = Matrix6d::Zero();
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();

  UncertainMotion keyframe_T_frame_measured() const;
};

FrameRecord record_of(const TrackedFrame& tracked);

/// A part of a scan without interruption: one log, or one live recording.
struct ScanPart {
  std::int64_t first_frame = 0;  ///< Frame numbers run on from part to part.
  std::string sensor;            ///< its name
  /// CRC-32 of the weights of the gradient model. Only surfaces from the same model share a gradient scale.
  std::uint32_t model_crc32 = 0;
  std::string log;  ///< file; empty where none was kept
};

/// Returns the index of the part that a frame belongs to; 0 if there are no parts.
std::size_t part_of_frame(const std::vector<ScanPart>& parts, std::int64_t frame);

/// Everything that a scan has measured, which is all that is needed to continue it: the results of tracking
/// and loop closure, before the pose graph is solved.
struct ScanRecord {
  std::vector<ScanPart> parts = {};  ///< In ascending order of first_frame.
  /// Keyframes by id. Null for an id whose keyframe was withdrawn.
  std::vector<std::shared_ptr<const Keyframe>> keyframes = {};
  /// For each keyframe in order, its odometry edge and then its loops.
  std::vector<PoseGraphEdge> edges = {};
  /// By keyframe id: whether loops were searched for. Always false for a patch.
  std::vector<bool> searched = {};
  std::vector<FrameRecord> frames = {};

  bool has_keyframe(int id) const {
    return id >= 0 && id < static_cast<int>(keyframes.size()) && keyframes[static_cast<std::size_t>(id)];
  }
  int last_keyframe() const { return static_cast<int>(keyframes.size()) - 1; }
  int last_trial() const;
  // Number and time of the first frame of a part that would follow.
  std::int64_t next_frame() const { return frames.empty() ? 0 : frames.back().frame + 1; }
  double next_time_s() const { return frames.empty() ? 0 : frames.back().time_s + kBetweenPartsS; }
  /// Returns the Unix time in microseconds at which `time_s` is 0, if every frame has a Unix time and these
  /// increase.
  std::optional<std::int64_t> start_unix_us() const;
  /// Returns the time of every frame as written to trajectories: Unix time, or `time_s` if start_unix_us() is
  /// not known.
  std::vector<double> stamps_s() const;
};

}  // namespace gelslam
