#include "live/live_record.hpp"

#include "gelslam/slam/slam_map.hpp"

namespace gelslam::slam::detail {

void RecordStage::run(RecordQueue& in, bool continued) {
  const auto guarded = [&](const auto& work) {
    try {
      work();
    } catch (const std::exception& error) {  // whatever it is, the scan goes on
      board_.warn(error.what());
      writer_.reset();
      is_whole_ = false;
    }
  };
  guarded([&] { writer_ = continued ? ScanWriter::append(folder_) : ScanWriter::begin(folder_); });
  while (const std::optional<RecordMessage> message = in.pop()) {
    if (writer_) guarded([&] { std::visit([&](const auto& content) { handle(content); }, *message); });
  }
  if (writer_) guarded([&] { writer_->flush(); });
}

void RecordStage::handle(const NewKeyframe& added) {
  const PoseGraphEdge link =
      added.link.previous ? odometry_edge(added.link, added.keyframe->id) : PoseGraphEdge{};
  writer_->add_keyframe(*added.keyframe, added.link.previous ? &link : nullptr);
}

void RecordStage::handle(const LoopsFound& found) { writer_->add_loops(found.keyframe, found.loops); }

void RecordStage::handle(const FrameRecord& frame) {
  if (!part_is_written_) {
    part_.first_frame = frame.frame;
    writer_->add_part(part_);
    part_is_written_ = true;
  }
  writer_->add_frame(frame);
}

}  // namespace gelslam::slam::detail
