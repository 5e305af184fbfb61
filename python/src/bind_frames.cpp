#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <mutex>

#include "arrays.hpp"
#include "bind.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#ifdef GELSLAM_BUILD_CAMERAS
#include "gelslam/sensor/camera.hpp"
#endif
#ifdef GELSLAM_BUILD_SIMULATION
#include "gelslam/simulation/simulated_camera.hpp"
#endif

namespace gelslam::python {
namespace {

namespace fs = std::filesystem;

py::tuple tuple_of(const TactileImage& image) { return py::make_tuple(array_of(image.bgr), image.time_s); }

/// Reads a log once, from its first image to its last.
class LogReader {
 public:
  LogReader(const fs::path& log, const SensorProfile& profile) : source_(open_frame_source(log, profile)) {}

  std::optional<TactileImage> next() {
    const std::lock_guard lock(mutex_);
    if (!source_) throw Error("the log is closed");
    return source_->next();
  }
  std::string warning() {
    const std::lock_guard lock(mutex_);
    if (source_) warning_ = source_->warning();
    return warning_;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    if (source_) warning_ = source_->warning();
    source_.reset();
  }

 private:
  std::mutex mutex_;  // Held while an image is read.
  std::unique_ptr<FrameSource> source_;
  std::string warning_;
};

/// A recorded log. Every iteration reads it from the beginning.
class Log {
 public:
  Log(const fs::path& log, const OptionalPath& config) : log_(log) {
    LogInput input;
    input.log = log;
    input.config = config.value_or("");
    profile_ = find_config(input).sensor;
    const std::unique_ptr<FrameSource> source = open_frame_source(log_, profile_);
    frames_ = source->frame_count();
    rate_hz_ = source->rate_hz();
    description_ = source->description();
  }

  std::shared_ptr<LogReader> read() {
    const std::lock_guard lock(mutex_);
    if (closed_) throw Error("the log is closed");
    return newest_ = std::make_shared<LogReader>(log_, profile_);
  }
  /// Returns the number of frames. If the log does not contain it, the log is read to count them.
  std::int64_t frames() {
    const std::lock_guard lock(mutex_);
    if (!frames_) {
      const std::unique_ptr<RawFrameSource> raw = open_raw_log(log_, profile_);
      std::int64_t count = 0;
      while (raw->next()) {
        if (++count % 100 == 0) check_signals();
      }
      frames_ = count;
    }
    return *frames_;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    if (newest_) newest_->close();
  }
  std::string warning() const {
    const std::lock_guard lock(mutex_);
    return newest_ ? newest_->warning() : "";
  }
  double rate_hz() const { return rate_hz_; }
  const std::string& description() const { return description_; }

 private:
  const fs::path log_;
  SensorProfile profile_;
  double rate_hz_;
  std::string description_;
  mutable std::mutex mutex_;
  std::optional<std::int64_t> frames_;
  bool closed_ = false;
  std::shared_ptr<LogReader> newest_;
};

template <class Source>
py::tuple next_frame(Source& source) {
  std::optional<TactileImage> image;
  {
    const WithoutGil release;
    image = source.next();
  }
  if (!image) throw py::stop_iteration();
  return tuple_of(*image);
}

void add_log(py::module_& module) {
  using Release = py::call_guard<WithoutGil>;
  py::class_<LogReader, std::shared_ptr<LogReader>>(module, "_LogReader", kOwnNew)
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &next_frame<LogReader>);
  py::class_<Log>(module, "Log", kOwnNew,
                  R"(A recorded log; iterating gives (image, time_s), each time from the beginning.

image: HxWx3 uint8, BGR, at the configuration's size. time_s: seconds since the first frame. len() counts damaged frames,
too, which are left out. Close it, or use `with`.)")
      .def(py::init<const fs::path&, const OptionalPath&>(), py::arg("path"), py::kw_only(),
           py::arg("config") = py::none())
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__",
           [](Log& self, const py::object&, const py::object&, const py::object&) {
             const WithoutGil release;
             self.close();
           })
      .def("__iter__", &Log::read, Release())
      .def("__len__", &Log::frames, Release())
      .def("close", &Log::close, Release(), "Closes the file. May be called twice.")
      .def_property_readonly("rate_hz", &Log::rate_hz, "Frames per second.")
      .def_property_readonly("description", &Log::description, "For people.")
      .def_property_readonly(
          "warning",
          [](const Log& self) {
            const WithoutGil release;
            return self.warning();
          },
          "What was not right with the frames of the newest iteration so far, or \"\".");
}

/// Records images in a log.
class Recorder {
 public:
  Recorder(const fs::path& path, const OptionalPath& config, const OptionalPath& model, double rate_hz)
      : writer_(path, attachments(config, model), rate_hz) {}

  void write(const cv::Mat3b& bgr, double time_s) {
    const std::lock_guard lock(mutex_);
    constexpr double kMostS = 1e9;  // LogWriter clamps times at this limit.
    if (!(time_s >= 0 && time_s <= kMostS))
      throw Error("time_s is not between 0 and 1e9; count the seconds from the first picture");
    if (time_s < last_s_) throw Error("time_s is before that of the picture before");
    if (closed_) throw Error("the log is closed");
    RawFrame frame;
    frame.encoding = FrameEncoding::bgr;
    frame.width_px = bgr.cols;
    frame.height_px = bgr.rows;
    frame.time_s = time_s;
    frame.bytes.assign(bgr.datastart, bgr.dataend);
    frame.index = frame.sequence = writer_.frames();
    if (!writer_.write(frame)) throw Error(writer_.failure());
    last_s_ = time_s;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    writer_.close();
  }

 private:
  static LogAttachments attachments(const OptionalPath& config, const OptionalPath& model) {
    LogInput input;
    input.config = config.value_or("");
    input.model = model.value_or("");
    return attachments_of(find_config(input));
  }

  std::mutex mutex_;
  LogWriter writer_;
  double last_s_ = 0;
  bool closed_ = false;
};

void add_recorder(py::module_& module) {
  using Release = py::call_guard<WithoutGil>;
  py::class_<Recorder>(module, "Recorder", kOwnNew,
                       R"(Writes pictures into a log (.mkv) without loss, as `gelslam record --resized`.

config, model: stored in the log. Close it, or use `with`; what was written before a crash can be read. For a camera's
own pictures in full size: `gelslam record`.)")
      .def(py::init<const fs::path&, const OptionalPath&, const OptionalPath&, double>(), py::arg("path"),
           py::kw_only(), py::arg("config") = py::none(), py::arg("model") = py::none(),
           py::arg("rate_hz") = 25.0)
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__",
           [](Recorder& self, const py::object&, const py::object&, const py::object&) {
             const WithoutGil release;
             self.close();
           })
      .def(
          "write",
          [](Recorder& self, const py::object& image, double time_s) {
            const Picture picture = picture_of(image, "image");
            const cv::Mat3b dense = picture.bgr.isContinuous() ? picture.bgr : cv::Mat3b(picture.bgr.clone());
            const WithoutGil release;
            self.write(dense, time_s);
          },
          py::arg("image"), py::arg("time_s"),
          "image: HxWx3 uint8, BGR, all of one size. time_s: seconds since the first; never smaller than "
          "before.")
      .def("close", &Recorder::close, Release(), "Closes the file. May be called twice.");
}

#ifdef GELSLAM_BUILD_CAMERAS
/// A camera that streams until it is closed. close() may be called while another thread waits for a frame.
class Camera {
 public:
  Camera(const std::string& device, const OptionalPath& config) {
    LogInput input;
    input.config = config.value_or("");
    const SensorProfile profile = find_config(input).sensor;
    decoder_.emplace(profile);
#ifdef GELSLAM_BUILD_SIMULATION
    if (device == kSimulatedCamera) {
      camera_ = simulated_camera();
      return;
    }
#endif
    CameraOptions options = camera_options(profile);
    options.device = device;
    options.gives_up = [] {
      check_signals();
      return false;
    };
    camera_ = open_camera(options);
  }
  ~Camera() { close(); }

  /// Returns the next complete image.
  std::optional<TactileImage> next() {
    const std::shared_ptr<RawFrameSource> camera = opened();
    const std::lock_guard lock(reading_);
    while (const std::optional<RawFrame> frame = camera->next()) {
      if (std::optional<TactileImage> image = decoder_->decode(*frame)) return image;
      check_signals();
    }
    return std::nullopt;
  }
  TactileImage read() {
    std::optional<TactileImage> image = next();
    if (!image) throw Error("the camera was closed");
    return *std::move(image);
  }
  void close() {
    std::shared_ptr<RawFrameSource> camera;
    {
      const std::lock_guard lock(opening_);
      camera.swap(camera_);
    }
    if (camera) camera->stop();
  }
  std::string description() const { return opened()->description(); }
  std::string warning() {
    std::string text = opened()->warning();
    const std::lock_guard lock(reading_);
    append_sentence(text, decoder_->warning());
    return text;
  }

 private:
  std::shared_ptr<RawFrameSource> opened() const {
    const std::lock_guard lock(opening_);
    if (!camera_) throw Error("the camera is closed");
    return camera_;
  }

  mutable std::mutex opening_;
  std::mutex reading_;
  std::shared_ptr<RawFrameSource> camera_;
  std::optional<FrameDecoder> decoder_;
};

void add_camera(py::module_& module) {
  using Release = py::call_guard<WithoutGil>;
  py::class_<Camera>(module, "Camera", kOwnNew,
                     R"(A sensor's camera; iterating gives (image, time_s), as of a Log.

device: "auto", "/dev/video2", "2", part of the camera's name, or "simulated" to try programs without one. Exposure, gain and focus are held. Close it, or use
`with`. A reader that is too slow misses frames.)")
      .def(py::init<const std::string&, const OptionalPath&>(), py::arg("device") = "auto", py::kw_only(),
           py::arg("config") = py::none(), Release())
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__",
           [](Camera& self, const py::object&, const py::object&, const py::object&) {
             const WithoutGil release;
             self.close();
           })
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &next_frame<Camera>)
      .def(
          "read",
          [](Camera& self) {
            TactileImage image;
            {
              const WithoutGil release;
              image = self.read();
            }
            return tuple_of(image);
          },
          "Waits for the next picture. Returns (image, time_s).")
      .def("close", &Camera::close, Release(), "Stops the camera. May be called twice.")
      .def_property_readonly("description", &Camera::description, "For people: name, format, rate.")
      .def_property_readonly("warning", py::cpp_function(&Camera::warning, Release()),
                             "What was not right with the frames so far, or \"\".");
}
#endif

}  // namespace

void bind_frames(py::module_& module) {
  add_log(module);
  add_recorder(module);
#ifdef GELSLAM_BUILD_CAMERAS
  add_camera(module);
#endif
}

}  // namespace gelslam::python
