#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <mutex>

#include "bind.hpp"
#include "frame.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"
#include "run.hpp"
#include "sensor.hpp"

namespace gelslam::python {
namespace {

/// Returns the record of a new scan, or that of the run folder to be continued.
ScanRecord scan_of(const Sensor& sensor, const OptionalPath& run) {
  if (run) return continue_scan(*run, sensor.config(), "");
  return {.parts = {part_of(sensor.config(), "")}};
}

/// Tracking and mapping, frame by frame. Calls of process() and finish() wait for each other.
class Slam {
 public:
  Slam(std::shared_ptr<Sensor> sensor, const OptionalPath& continue_from)
      : Slam(sensor, scan_of(*sensor, continue_from)) {}

  FrameReport process(const cv::Mat3b& bgr, double time_s) {
    SurfacePtr surface;
    {
      const auto scope = timer_.measure("surface");
      surface = sensor_->estimate(bgr, "image").maps;
    }
    return process(std::move(surface), time_s);
  }

  FrameReport process(SurfacePtr surface, double time_s) {
    const std::lock_guard lock(mutex_);
    require_pixels(*surface, sensor_->background().size(), sensor_->config().surface.pixel_pitch_mm,
                   "surface");
    times_.check(first_time_s_ + time_s);
    FrameReport report{slam_.process(frames_++, first_time_s_ + time_s, std::move(surface), timer_)};
    report.in_trial = trial_map_.add(report.tracked);
    return without_surfaces(std::move(report));
  }

  MetricMesh mesh(ProgressSink& progress) const {
    return MetricMesh(fuse_map(map_so_far(progress), sensor_->config().slam.fusion, &progress));
  }

  std::vector<StampedPose> trajectory(ProgressSink& progress) const {
    return map_so_far(progress).trajectory();
  }

  PythonRun finish(ProgressSink& progress) {
    const std::lock_guard lock(mutex_);
    const auto start = std::chrono::steady_clock::now();
    RunReport report;
    report.log_description = "frames of a Python program";
    slam_.end_trial(timer_);
    return python_run(finish_scan(sensor_->config(), slam_.finish(true, &progress), std::move(report), timer_,
                                  start, &progress));
  }

 private:
  Slam(std::shared_ptr<Sensor> sensor, const ScanRecord& scan)
      : sensor_(std::move(sensor)),
        slam_(sensor_->config().slam, scan),
        trial_map_(sensor_->config().slam.gradient_scale),
        first_time_s_(scan.next_time_s()),
        frames_(scan.next_frame()) {
    if (!scan.frames.empty()) times_.begin_after(scan.frames.back().time_s);
  }

  /// Solves the current map; tracking can continue meanwhile.
  SlamMap map_so_far(ProgressSink& progress) const {
    ScanRecord scan;
    {
      const std::lock_guard lock(mutex_);
      scan = slam_.measured();
    }
    return solve_scan(
        std::move(scan), sensor_->config().slam, false, [] { return false; }, &progress);
  }

  const std::shared_ptr<Sensor> sensor_;
  mutable std::mutex mutex_;
  mutable StageTimer timer_;
  GelSlam slam_;
  TrialMap trial_map_;
  const double first_time_s_;
  std::int64_t frames_;
  FrameTimes times_;
};

/// Runs work without the GIL; Ctrl-C ends it.
template <auto work, typename AnySlam>
auto interruptible(AnySlam& slam) {
  PythonProgress silent{py::none()};
  const WithoutGil release;
  return (slam.*work)(silent);
}

std::optional<py::array_t<double>> trial_pose(const FrameReport& self) {
  if (self.tracked.status != TrackStatus::tracked) return std::nullopt;
  return array_of(self.tracked.trial_T_frame);
}

template <auto part>
std::optional<py::array_t<double>> sigma_part(const FrameReport& self) {
  if (!self.in_trial) return std::nullopt;
  return part(sigma_of(self.in_trial->map_T_frame.covariance));
}

std::optional<py::array_t<double>> frame_covariance(const FrameReport& self) {
  if (!self.in_trial) return std::nullopt;
  return scaled_array_of(self.in_trial->map_T_frame.covariance, kMetersPerMm);
}

std::vector<std::int64_t> new_keyframes(const FrameReport& self) {
  std::vector<std::int64_t> frames;
  for (const NewKeyframe& added : self.tracked.new_keyframes) frames.push_back(added.keyframe->frame);
  return frames;
}

void add_frame(py::module_& module) {
  py::class_<FrameReport>(module, "TrackedFrame", kOwnNew,
                          R"(What is known of a frame right after it was tracked.

A trial is an unbroken stretch of tracking. Its frame is that of the sensor in its first tracked frame.)")
      .def_property_readonly(
          "frame", [](const FrameReport& self) { return self.tracked.frame; },
          "Counts frames from 0; of a continued scan from its end.")
      .def_property_readonly(
          "time_s", [](const FrameReport& self) { return self.tracked.time_s; },
          "As given, seconds; of a continued scan counted on from its end.")
      .def_property_readonly(
          "status", [](const FrameReport& self) { return std::string(name(self.tracked.status)); },
          "\"tracked\", \"no_contact\" or \"lost\".")
      .def_property_readonly(
          "trial",
          [](const FrameReport& self) -> std::optional<int> {
            if (self.tracked.trial < 0) return std::nullopt;
            return self.tracked.trial;
          },
          "Number of the trial, from 0; None without contact.")
      .def_property_readonly("trial_T_sensor", &trial_pose,
                             "4x4: sensor to trial, translation in meters; None when not tracked.")
      .def_property_readonly(
          "sigma_mm", &sigma_part<&sigma_mm_of>,
          "3: one standard deviation of the pose in its trial along the sensor's x, y, z, mm; or None.")
      .def_property_readonly("sigma_rad", &sigma_part<&sigma_rad_of>,
                             "3: the same about x, y, z, rad; or None.")
      .def_property_readonly("covariance", &frame_covariance,
                             "6x6: of `noise` in true = trial_T_sensor * exp(noise): x, y, z, rx, ry, rz, "
                             "along the sensor's\naxes; meters and radians; or None.")
      .def_property_readonly("new_keyframes", &new_keyframes,
                             "list of int: the frames that became keyframes now: this one or earlier ones.")
      .def_property_readonly(
          "registration",
          [](const FrameReport& self) -> std::optional<RegistrationResult> {
            if (self.tracked.trial < 0) return std::nullopt;
            return self.tracked.registration;
          },
          "Registration to the keyframe, or None.")
      .def_property_readonly(
          "reason",
          [](const FrameReport& self) -> std::string {
            switch (self.tracked.status) {
              case TrackStatus::no_contact:
                return "nothing touches the sensor";
              case TrackStatus::tracked:
                return describe_observability(self.tracked.registration.observable);
              default:
                return reason_of(self.tracked.registration);
            }
          },
          "Why it is not tracked; or which motions are not observable; or \"\".")
      .def("__repr__", [](const FrameReport& self) {
        return "<gelslam.TrackedFrame " + std::to_string(self.tracked.frame) + ", " +
               std::string(name(self.tracked.status)) + ">";
      });
}

}  // namespace

FrameReport without_surfaces(FrameReport report) {
  report.surface = nullptr;
  report.tracked.keyframe = nullptr;
  for (NewKeyframe& added : report.tracked.new_keyframes) {
    auto number = std::make_shared<Keyframe>();
    number->frame = added.keyframe->frame;
    added.keyframe = std::move(number);
  }
  return report;
}

py::array_t<double> sigma_mm_of(const Vector6d& sigma) { return py::array_t<double>(3, sigma.data()); }
py::array_t<double> sigma_rad_of(const Vector6d& sigma) { return py::array_t<double>(3, sigma.data() + 3); }

void FrameTimes::check(double time_s) {
  if (!(std::abs(time_s) <= kMaxTimeS) || (last_time_s_ && time_s <= *last_time_s_))
    throw Error("time_s: expected seconds that grow from frame to frame, got " + std::to_string(time_s) +
                (last_time_s_ ? " after " + std::to_string(*last_time_s_) : ""));
  last_time_s_ = time_s;
}

void bind_slam(py::module_& module) {
  add_frame(module);
  using Release = py::call_guard<WithoutGil>;
  py::class_<Slam>(module, "Slam", kOwnNew,
                   R"(Tracks and maps frame by frame, for instance those of a camera.

Keeps keyframes only. Its map is the one that reconstruct() makes of the same pictures. Threads that call process() and
finish() wait for each other. continue_from: a run folder whose scan it goes on with, of the same object, sensor and model.)")
      .def(py::init<std::shared_ptr<Sensor>, const OptionalPath&>(), py::arg("sensor").none(false),
           py::kw_only(), py::arg("continue_from") = py::none(), Release())
      .def(
          "process",
          [](Slam& self, const TouchedSurface& surface, double time_s) {
            return self.process(surface.maps, time_s);
          },
          py::arg("surface"), py::arg("time_s"), Release(),
          "Tracks a Surface that was taken at time_s (seconds, growing). Returns a TrackedFrame.")
      .def(
          "process",
          [](Slam& self, const py::object& image, double time_s) {
            const Picture picture = picture_of(image, "image");
            const WithoutGil release;
            return self.process(picture.bgr, time_s);
          },
          py::arg("image"), py::arg("time_s"), "The same for a picture (HxWx3 uint8, BGR).")
      .def("mesh", &interruptible<&Slam::mesh, const Slam>,
           "The surface as far as it is known, a Mesh. Takes tenths of a second; meanwhile another thread "
           "may track.")
      .def(
          "trajectory",
          [](Slam& self) {
            const std::vector<StampedPose> poses = interruptible<&Slam::trajectory, const Slam>(self);
            return py::make_tuple(times_of(poses), poses_of(poses));
          },
          "(times, poses) of all frames in the map as far as it is known, as Run.times and Run.trajectory; "
          "poses of earlier\nframes change when a loop is closed. As mesh().")
      .def(
          "finish",
          [](Slam& self) {
            PythonRun run = interruptible<&Slam::finish>(self);
            warn_of(run);
            return run;
          },
          "Closes loops, calibrates slopes, fuses. Returns a Run. Frames that follow begin a new trial.");
}

}  // namespace gelslam::python
