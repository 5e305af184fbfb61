#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "gelslam/core/process.hpp"
#include "gelslam/sensor/camera.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/live_slam.hpp"

namespace gelslam {

/// Frames of a camera or log, and what a recording of them should hold beside them; nothing: none is made.
struct CameraInput {
  std::unique_ptr<RawFrameSource> frames;
  std::optional<LogAttachments> attachments{};
};

inline constexpr double kReconnectTimeoutS =
    60;  ///< how long recordings and scans wait for a camera that was lost

/// The camera that the configuration names, or `device` if that is not empty; kSimulatedCamera, too.
/// `reconnect_timeout_s`: CameraOptions. Throws Error like open_camera(), and when Ctrl-C was pressed
/// meanwhile.
CameraInput open_camera_input(const Config& config, const std::string& device,
                              double reconnect_timeout_s = 0);

/// Where `device` is the simulated camera and no model is named: names its own, a file in the user's cache
/// folder. Throws Error.
void use_simulated_model(const std::string& device, std::string& model);

/// A camera whose first frames are those that were the background of the scan before: the scan has the same
/// background, and its log can be replayed alone.
std::unique_ptr<RawFrameSource> after_background(BackgroundFrames background,
                                                 std::unique_ptr<RawFrameSource> camera);

/// For what a person did not name: "gelslam-20261120-083000", local time.
std::string name_by_time();

/// Does `work` on a thread of its own, which never waits for the window that `show` shows on this one. When
/// that has been closed or has failed, `stop` must make `work` return soon. Throws what either threw.
void work_beside_window(const std::function<void()>& work, const std::function<void()>& show,
                        const std::function<void()>& stop);

/// Does once what Ctrl-C asks for, whatever the other threads wait for: a camera may keep next() waiting for
/// seconds. `ends`: regularly with a camera, early with a log.
class InterruptStopper {
 public:
  InterruptStopper(InterruptWatch::Ends ends, std::function<void()> stop)
      : interrupt_(1, ends), thread_([this, stop = std::move(stop)](const std::stop_token& done) {
          while (!done.stop_requested()) {
            if (interrupt_.requested()) return stop();
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
          }
        }) {}
  bool requested() const { return interrupt_.requested(); }

 private:
  InterruptWatch interrupt_;
  std::jthread thread_;
};

}  // namespace gelslam
