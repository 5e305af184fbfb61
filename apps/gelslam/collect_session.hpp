#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>

#include "gelslam/calibration/press_collector.hpp"
#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/calibration/press_folder.hpp"
#include "gelslam/calibration/press_window.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

struct CollectOptions : CollectorOptions {
  std::filesystem::path folder;
  int presses = 50;          ///< Wanted number of presses of this ball, including those that already exist.
  bool keep_optics = false;  ///< Store the optics beside the presses.
  bool headless = false;     ///< Ends with enough presses, or when the source ends, or with stop().
};

/// Passes a source's images to a PressCollector, stores its presses in a folder, and tells the user what
/// happens.
class CollectSession final : public CollectWatch {
 public:
  /// `folder` must be that of the options. `say` is called with one line for each event, from run()'s thread.
  CollectSession(RawFrameSource& source, const SensorProfile& profile, PressFolder folder,
                 const CollectOptions& options, std::function<void(const std::string&)> say);

  /// Runs until the source ends, stop() is called or, if requested, there are enough presses; then stores the
  /// press that is still held. Throws Error when there is no bare gel at the start, when the sensor is not
  /// that of the folder, or when the source or the disk fails; presses stored before that are kept.
  void run();
  void stop();                      ///< May be called from any thread.
  void close() { closes_ = true; }  ///< Allows the window to close.

  CollectView view() const override;
  std::vector<TakenPress> taken() override;
  void count(const std::vector<ContactCircle>& contacts) override;
  double diameter_mm() const override { return options_.diameter_mm; }

  int taken_now() const;  ///< Presses in this session.
  bool enough() const;
  std::string summary() const;  ///< What exists, and what is missing.

 private:
  void watch();
  [[noreturn]] void refuse_without_background() const;
  void look_at(const cv::Mat3b& bgr);
  void begin_presses();
  void add(const ContactCircle& circle);
  std::string depth_warning() const;
  void keep(const CollectedPress& press);
  void say_warning();

  RawFrameSource& source_;
  SensorProfile profile_;
  CollectOptions options_;
  std::function<void(const std::string&)> say_;
  mutable std::mutex mutex_;  // Protects everything below except the flags.
  PressCollector collector_;
  PressFolder folder_;
  PressCoverage coverage_;
  std::vector<TakenPress> taken_;
  int taken_now_ = 0;
  std::vector<double> rim_slopes_;  ///< Of all presses of this ball.
  cv::Mat3b newest_;
  std::string warned_;
  std::int64_t damaged_ = 0;
  std::atomic<bool> stops_ = false, closes_ = false;
};

}  // namespace gelslam
