#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/backend/rig.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/live_slam.hpp"

namespace gelslam {

struct LiveRigOptions {
  std::filesystem::path run_folder;  ///< of the one map; the sensors' own are RUN-first and RUN-second
  bool overwrite = false;
  std::filesystem::path rig;  ///< rig.yaml, or a run; empty: the motions tell
  bool continued = false;     ///< the map goes on from the run in `run_folder` (MergeRequest::in_place)
};

/// RUN-first or RUN-second.
std::filesystem::path run_of_sensor(const std::filesystem::path& run_folder, int sensor);

/// Two sensors that are fixed to each other, live. Each has a LiveSlam and a run folder of its own, so that
/// one goes on when the other is lost. At the end merge_scans() makes one map of what both have saved. Until
/// then the second one's map is shown in that of the first as soon as it is known how they are fixed.
class LiveRig final : public LiveSession {
 public:
  struct Sensor {
    std::unique_ptr<RawFrameSource> source;  ///< frames of both count their time from one start
    LiveOptions options;                     ///< run_folder: run_of_sensor()
  };

  /// Starts at once. Throws Error like LiveSlam.
  LiveRig(std::array<Sensor, 2> sensors, const LiveRigOptions& options);
  ~LiveRig() override;  ///< aborts if wait() was not called

  LiveStatus status() const override;
  std::shared_ptr<const LiveTouch> touch() const override;
  std::vector<std::shared_ptr<const LiveTouch>> touches() const override;
  std::shared_ptr<const MapSnapshot> map() const override;
  MeshChanges take_mesh_changes() override;
  std::vector<StageStatistics> stage_times() const override;  ///< of the first sensor

  void set_paused(bool paused) override;
  void undo_last_trial() override;  ///< of the sensor that touch() is of
  void save_now() override;
  void stop() override;
  void abort() override;

  /// Waits until both have ended and the one map is saved. Throws Error when that cannot be; what each sensor
  /// has saved stays.
  RunReport wait();
  BackgroundFrames background_frames(int sensor) const;  ///< LiveSlam::background_frames()

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
