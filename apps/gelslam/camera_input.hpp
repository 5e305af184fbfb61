#pragma once

#include <chrono>
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

/// Frames of a camera or log, with the attachments for a recording of them; none if there is no recording.
struct CameraInput {
  std::unique_ptr<RawFrameSource> frames;
  std::optional<LogAttachments> attachments{};
};

inline constexpr double kReconnectTimeoutS =
    60;  ///< How long recordings and scans wait for a camera that was lost.

/// Opens the camera that the configuration names, or `device` if it is not empty, which may be
/// kSimulatedCamera. `reconnect_timeout_s`: see CameraOptions. Throws Error as open_camera(), and when Ctrl-C
/// is pressed meanwhile.
CameraInput open_camera_input(const Config& config, const std::string& device,
                              double reconnect_timeout_s = 0);

/// If `device` is the simulated camera and no model is named, sets `model` to its own model, a file in the
/// user's cache folder. Throws Error.
void use_simulated_model(const std::string& device, std::string& model);

/// Returns a camera whose first frames are the background frames of the previous scan. The new scan then has
/// the same background, and its log can be replayed on its own.
std::unique_ptr<RawFrameSource> after_background(BackgroundFrames background,
                                                 std::unique_ptr<RawFrameSource> camera);

/// Returns a name for output that the user did not name: "gelslam-20261120-083000", local time.
std::string name_by_time();

/// Runs `work` on its own thread, which never waits for the window that `show` shows on this one. When the
/// window was closed or has failed, `stop` is called and must make `work` return soon. Throws what either
/// threw.
void work_beside_window(const std::function<void()>& work, const std::function<void()>& show,
                        const std::function<void()>& stop);

/// Calls `stop` once when Ctrl-C is pressed, even while other threads are blocked: a camera may keep next()
/// waiting for seconds. `ends` is regularly for a camera, early for a log.
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
