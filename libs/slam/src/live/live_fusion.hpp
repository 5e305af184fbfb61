#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "live/live_board.hpp"

namespace gelslam::slam::detail {

/// The fusion thread: it updates the displayed mesh to the newest map in short steps and skips maps that
/// arrive faster.
class FusionStage {
 public:
  FusionStage(const FusionOptions& options, LiveBoard& board, StageTimer& timer)
      : options_(options), board_(board), timer_(timer) {}

  void run();
  void set_map(std::shared_ptr<const MapSnapshot> map);  ///< from another thread; returns at once
  void stop();                                           ///< run() returns after the present piece of work

 private:
  std::shared_ptr<const MapSnapshot> wait_for_map(bool work_left);
  void follow(const MapSnapshot& map);
  bool work();  ///< true while there is more to do

  const FusionOptions options_;
  LiveBoard& board_;
  StageTimer& timer_;
  std::unique_ptr<IncrementalFusion> fusion_;
  int component_ = -1;    // what fusion_ holds
  bool cleared_ = false;  // not told to the board yet

  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const MapSnapshot> newest_;
  bool stopped_ = false;
};

}  // namespace gelslam::slam::detail
