#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "live/live_board.hpp"
#include "live/live_messages.hpp"
#include "run_folder/scan_writer.hpp"

namespace gelslam::slam::detail {

struct LoopsFound {
  int keyframe = 0;
  std::vector<PoseGraphEdge> loops;
};

using RecordMessage = std::variant<NewKeyframe, LoopsFound, FrameRecord, ForgetFromTrial>;
using RecordQueue = BoundedQueue<RecordMessage>;

/// The thread that writes the session while the scan goes on. A full disk ends the session, not the scan.
class RecordStage {
 public:
  /// `folder`: the session's. `part`: what the scan begins or continues with.
  RecordStage(std::filesystem::path folder, ScanPart part, LiveBoard& board)
      : folder_(std::move(folder)), part_(std::move(part)), board_(board) {}

  /// `continued`: the scan's record is there and goes on.
  void run(RecordQueue& in, bool continued);
  bool is_whole() const { return is_whole_; }  ///< thread-safe

 private:
  void handle(const NewKeyframe& added);
  void handle(const LoopsFound& found);
  void handle(const FrameRecord& frame);
  void handle(ForgetFromTrial forget) { writer_->forget_from_trial(forget.trial); }

  const std::filesystem::path folder_;
  ScanPart part_;
  LiveBoard& board_;
  std::optional<ScanWriter> writer_;  // none after a failure
  std::atomic<bool> is_whole_{true};
  bool part_is_written_ = false;
};

}  // namespace gelslam::slam::detail
