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
  int presses = 50;          ///< of this ball, those that are there already included
  bool keep_optics = false;  ///< beside the presses
  bool headless = false;     ///< ends with enough presses, else when the source ends or with stop()
};

/// Brings a source's pictures to a PressCollector, its presses into a folder, and words to people.
class CollectSession final : public CollectWatch {
 public:
  /// `folder`: that of the options. `say`: told what happens, line by line, from run()'s thread.
  CollectSession(RawFrameSource& source, const SensorProfile& profile, PressFolder folder,
                 const CollectOptions& options, std::function<void(const std::string&)> say);

  /// Until the source ends, stop() or, if asked for, enough presses; then keeps the press that is still held.
  /// Throws Error: no bare gel at the start, another sensor than the folder's, a source or disk that fails;
  /// presses taken before that are kept.
  void run();
  void stop();                      ///< from any thread
  void close() { closes_ = true; }  ///< lets the window close

  CollectView view() const override;
  std::vector<TakenPress> taken() override;
  void count(const std::vector<ContactCircle>& contacts) override;
  double diameter_mm() const override { return options_.diameter_mm; }

  int taken_now() const;  ///< in this session
  bool enough() const;
  std::string summary() const;  ///< what there is, and what is missing

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
  mutable std::mutex mutex_;  // of all that follows but the flags
  PressCollector collector_;
  PressFolder folder_;
  PressCoverage coverage_;
  std::vector<TakenPress> taken_;
  int taken_now_ = 0;
  std::vector<double> rim_slopes_;  ///< of all presses of this ball
  cv::Mat3b newest_;
  std::string warned_;
  std::int64_t damaged_ = 0;
  std::atomic<bool> stops_ = false, closes_ = false;
};

}  // namespace gelslam
