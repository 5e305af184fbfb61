#pragma once

#include <cstdint>
#include <memory>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// GelSLAM (Huang et al., T-RO 2026; what differs: docs/algorithms.md), frame by frame. Its stages:
///
///   surface      a picture gives heights, normals, curvature, contact               SurfaceStream
///   track        a surface gives its pose to a keyframe, and keyframes (§IV)        Tracker
///   close loops  a keyframe gives its motions to earlier ones of the same place (§V)  LoopCloser
///   optimize     all motions give the keyframes' poses and the slope correction     solve_pose_graph()
///   fuse         surfaces at these poses give one mesh                              fuse_map()
///
/// process() tracks and closes loops, finish() optimizes; the first and the last stage are called beside it
/// (as reconstruct() does). Only keyframes are kept. Deterministic.
class GelSlam {
 public:
  /// `continued`: null for a new scan.
  explicit GelSlam(const SlamOptions& options, const ContinuedScan* continued = nullptr);
  ~GelSlam();
  GelSlam(GelSlam&&) noexcept;

  /// Track, close loops. `surface`: of the next frame. Returns its pose in its trial, and the keyframes made
  /// of it.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer);

  /// A frame that has no surface (background).
  void skip(std::int64_t frame, double time_s);

  /// Optimize: all keyframes' poses in the frame of the map's anchor, and how well they are known. May be
  /// called at any time; frames may follow. `refine` true: with overlap edges and slope calibration; false:
  /// with the edges that are known, which takes tenths of a second. Tells `progress` (null: nobody) of the
  /// tasks "closing loops" and "calibrating slopes".
  SlamMap finish(bool refine = true, ProgressSink* progress = nullptr) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
