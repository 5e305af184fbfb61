// Prints the sensor's pose in each frame of a log, as TUM lines (meters). Usage: track_video LOG [MODEL]
#include <gelslam/core/error.hpp>
#include <gelslam/core/trajectory.hpp>
#include <gelslam/frontend/tracker.hpp>
#include <gelslam/slam/surface_stream.hpp>
#include <iostream>

int main(int argc, char** argv) try {
  if (argc < 2) throw gelslam::Error("usage: track_video LOG [MODEL]");
  gelslam::LogInput input;
  input.log = argv[1];
  if (argc > 2) input.model = argv[2];
  const gelslam::Config config = resolve_config(input);

  gelslam::StageTimer timer;
  gelslam::SurfaceStream stream(input, config, timer);
  gelslam::Tracker tracker(config.slam.tracker, config.slam.registration, config.slam.verification);
  while (const auto item = stream.next()) {
    if (!item->surface) continue;  // the bare gel, at the beginning
    const gelslam::TrackedFrame frame = tracker.track(item->image.index, item->image.time_s, item->surface);
    if (frame.status == gelslam::TrackStatus::tracked)
      std::cout << gelslam::tum_line(frame.time_s, frame.trial_T_frame);
  }
} catch (const gelslam::Error& error) {
  std::cerr << error.what() << "\n";
  return 2;
}
