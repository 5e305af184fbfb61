#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "bind.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/slopes.hpp"
#include "sensor.hpp"

namespace gelslam::python {
namespace {

/// Returns an HxW or HxWxC view of a map of the surface; the Python object `self` keeps it alive.
template <class Mat>
py::array map_view(const py::object& self, const Mat& mat) {
  using Number = typename cv::DataType<typename Mat::value_type>::channel_type;
  const auto step = static_cast<py::ssize_t>(sizeof(Number));
  const py::ssize_t channels = mat.channels();
  std::vector<py::ssize_t> shape{mat.rows, mat.cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(mat.step[0]), channels * step};
  if (channels > 1) {
    shape.push_back(channels);
    strides.push_back(step);
  }
  return view(py::dtype::of<Number>(), std::move(shape), std::move(strides), mat.data, self);
}

const Surface& maps_of(const py::object& self) { return *self.cast<const TouchedSurface&>().maps; }

py::array_t<bool> contact_of(const TouchedSurface& surface) {
  const cv::Mat1b& contact = surface.maps->contact;
  py::array_t<bool> array({contact.rows, contact.cols});
  auto values = array.mutable_unchecked<2>();
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u) values(v, u) = contact(v, u) != 0;
  return array;
}

/// Returns the standard deviation of the slopes (rad), by inverting Surface::confidence.
py::array_t<float> sigma_of(const TouchedSurface& surface) {
  const Surface& maps = *surface.maps;
  const cv::Mat1b& confidence = maps.confidence.empty() ? maps.contact : maps.confidence;
  const auto best = static_cast<float>(surface.best_sigma_rad);
  py::array_t<float> array({confidence.rows, confidence.cols});
  auto values = array.mutable_unchecked<2>();
  for (int v = 0; v < confidence.rows; ++v)
    for (int u = 0; u < confidence.cols; ++u)
      values(v, u) = confidence(v, u) == 0 ? std::numeric_limits<float>::infinity()
                                           : best * std::sqrt(255.0F / static_cast<float>(confidence(v, u)));
  return array;
}

py::array_t<float> points_of(const TouchedSurface& surface) {
  const Surface& maps = *surface.maps;
  py::array_t<float> array({maps.height_mm.rows, maps.height_mm.cols, 3});
  auto values = array.mutable_unchecked<3>();
  for (int v = 0; v < maps.height_mm.rows; ++v)
    for (int u = 0; u < maps.height_mm.cols; ++u) {
      const Eigen::Vector3d point = maps.point_mm({u, v});
      for (int axis = 0; axis < 3; ++axis) values(v, u, axis) = static_cast<float>(point[axis]);
    }
  return array;
}

py::tuple pickled_surface(const py::object& self) {
  const Surface& maps = maps_of(self);
  const SensorOptics& optics = maps.optics;
  return py::make_tuple(
      map_view(self, maps.height_mm), map_view(self, maps.normals), map_view(self, maps.contact),
      map_view(self, maps.confidence), map_view(self, maps.curvature), maps.pixel_pitch_mm,
      maps.slope_sigma_ratio, maps.contact_pixels, maps.zero_is_bare_gel,
      self.cast<const TouchedSurface&>().best_sigma_rad, optics.lens_k1, optics.lens_center_px,
      optics.pixel_aspect, optics.camera_distance_mm, optics.gel_dome_per_mm, maps.slope_noise_ratio);
}

/// Copies an array that map_view() returned back into a map.
template <class Mat>
void copy_to(Mat& mat, const py::handle& array) {
  using Number = typename cv::DataType<typename Mat::value_type>::channel_type;
  const auto values = py::array_t<Number, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!values || values.ndim() < 2) throw Error("this is no pickled gelslam.Surface");
  mat.create(static_cast<int>(values.shape(0)), static_cast<int>(values.shape(1)));
  if (mat.total() * static_cast<std::size_t>(mat.channels()) != static_cast<std::size_t>(values.size()))
    throw Error("this is no pickled gelslam.Surface");
  std::copy_n(values.data(), values.size(), reinterpret_cast<Number*>(mat.data));
}

TouchedSurface unpickled_surface(const py::tuple& state) {
  const auto maps = std::make_shared<Surface>();
  copy_to(maps->height_mm, state[0]);
  copy_to(maps->normals, state[1]);
  copy_to(maps->contact, state[2]);
  copy_to(maps->confidence, state[3]);
  copy_to(maps->curvature, state[4]);
  const cv::Size size = maps->height_mm.size();
  for (const cv::Mat& other : std::initializer_list<cv::Mat>{maps->normals, maps->contact, maps->curvature})
    if (other.size() != size) throw Error("this is no pickled gelslam.Surface");
  maps->pixel_pitch_mm = state[5].cast<double>();
  if (!is_possible_picture(size, maps->pixel_pitch_mm) ||
      (!maps->confidence.empty() && maps->confidence.size() != size))
    throw Error("this is no pickled gelslam.Surface");
  maps->slope_sigma_ratio = state[6].cast<double>();
  maps->contact_pixels = cv::countNonZero(maps->contact);
  maps->zero_is_bare_gel = state[8].cast<bool>();
  maps->optics = {state[10].cast<double>(), state[11].cast<std::array<double, 2>>(), state[12].cast<double>(),
                  state[13].cast<double>(), state[14].cast<std::array<double, 2>>()};
  maps->slope_noise_ratio = state[15].cast<double>();
  return {maps, state[9].cast<double>()};
}

/// Makes a surface from slopes (mm per mm) that other software measured.
TouchedSurface surface_of_slopes(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched,
                                 double pixel_pitch_mm, double slope_sigma_rad) {
  constexpr int kMinPx = 16;
  const cv::Size size = gx.size();
  if (std::min(size.width, size.height) < kMinPx || !is_possible_picture(size, pixel_pitch_mm))
    throw Error("no sensor has pictures of " + size_text(size.width, size.height) + " pixels and " +
                std::to_string(pixel_pitch_mm) + " mm per pixel");
  if (touched.size() != size)
    throw Error("contact: is " + size_text(touched.cols, touched.rows) + " pixels, not " +
                size_text(size.width, size.height));
  if (!cv::checkRange(gx) || !cv::checkRange(gy)) throw Error("a slope is not finite");
  if (!(slope_sigma_rad > 0)) throw Error("slope_sigma_rad: expected radians above 0");
  auto maps = std::make_shared<Surface>(
      *GradientSurfaces(CameraModel{size, pixel_pitch_mm, {}}).make(gx, gy, touched));
  maps->slope_sigma_ratio = std::max(1.0, slope_sigma_rad / kBestSlopeSigmaRad);
  return {maps, kBestSlopeSigmaRad * maps->slope_sigma_ratio};
}

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

/// Returns a cv::Mat that shares the array's memory. With 1 channel the shape is HxW, else HxWxchannels.
template <class Mat, class Array>
Mat mat_of(const Array& array, int channels, const std::string& name) {
  constexpr py::ssize_t kMaxPixelsPerSide = 16384;
  if (array.ndim() != (channels == 1 ? 2 : 3) || (channels > 1 && array.shape(2) != channels) ||
      std::max(array.shape(0), array.shape(1)) > kMaxPixelsPerSide)
    throw Error(name + ": expected an array of " +
                (channels == 1 ? "height x width" : "height x width x " + std::to_string(channels)) +
                ", got shape " + std::string(py::str(array.attr("shape"))));
  return Mat(
      static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
      static_cast<typename Mat::value_type*>(const_cast<void*>(static_cast<const void*>(array.data()))));
}

TouchedSurface surface_of_normals(const Floats& normals, const Flags& contact, double pixel_pitch_mm,
                                  double slope_sigma_rad) {
  const auto n = mat_of<cv::Mat3f>(normals, 3, "normals");
  const auto touched = mat_of<cv::Mat1b>(contact, 1, "contact");
  const WithoutGil release;
  cv::Mat1f gx(n.size()), gy(n.size());
  for (int v = 0; v < n.rows; ++v)
    for (int u = 0; u < n.cols; ++u) {
      const cv::Vec3f& normal = n(v, u);
      if (!(normal[2] > 0)) throw Error("normals: z has to be above 0: they point out of the gel");
      gx(v, u) = -normal[0] / normal[2];
      gy(v, u) = -normal[1] / normal[2];
    }
  return surface_of_slopes(gx, gy, touched, pixel_pitch_mm, slope_sigma_rad);
}

TouchedSurface surface_of_height(const Floats& height_mm, const Flags& contact, double pixel_pitch_mm,
                                 double slope_sigma_rad) {
  const auto height = mat_of<cv::Mat1f>(height_mm, 1, "height_mm");
  const auto touched = mat_of<cv::Mat1b>(contact, 1, "contact");
  // Heights given in meters by mistake would be at most 0.01, less than a camera can resolve of a touch
  // in millimeters.
  constexpr double kThickestGelMm = 10;
  if (const double deepest = cv::norm(height, cv::NORM_INF, touched);
      deepest > 0 && deepest < 1e-3 * kThickestGelMm)
    warn("height_mm is at most " + short_number(deepest) + " mm in contact: is it in meters?");
  const WithoutGil release;
  cv::Mat1f gx, gy;
  const auto per_mm = static_cast<float>(0.5 / pixel_pitch_mm);
  const cv::Matx13f along(-per_mm, 0, per_mm);
  cv::filter2D(height, gx, CV_32F, along, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::filter2D(height, gy, CV_32F, along.t(), {-1, -1}, 0, cv::BORDER_REPLICATE);
  const TouchedSurface surface = surface_of_slopes(gx, gy, touched, pixel_pitch_mm, slope_sigma_rad);
  if (cv::mean(height, touched)[0] > 0)
    throw Error("height_mm: expected negative heights in contact: the object presses into the gel");
  auto maps = std::make_shared<Surface>(*surface.maps);
  maps->height_mm = height.clone();
  maps->zero_is_bare_gel = true;
  return {maps, surface.best_sigma_rad};
}

void add_surface(py::module_& module) {
  py::class_<TouchedSurface>(module, "Surface", kOwnNew,
                             R"(What the gel's surface looks like in one picture.

All maps have H rows and W columns. Frame: x right, y down, z out of the gel toward the object; the origin is the
picture's center on the plane z = 0. The ray of pixel (row v, column u) meets that plane at
X = (u - W/2 + 1/2) * pixel_pitch_mm, Y = (v - H/2 + 1/2) * pixel_pitch_mm; points_mm() gives what it shows. The arrays
are read-only.)")
      .def_static("from_normals", &surface_of_normals, py::arg("normals"), py::arg("contact"),
                  py::arg("pixel_pitch_mm"), py::kw_only(), py::arg("slope_sigma_rad") = kBestSlopeSigmaRad,
                  R"(A Surface of normals that other software measured, for register(), Slam and Localizer.

normals: HxWx3, relative to the gel at rest: (0, 0, 1) where nothing touches, x right, y down, z > 0 out of the gel.
contact: HxW bool; its border, 1/48 of the height, is left out. pixel_pitch_mm: millimeters per pixel; the camera counts
as orthographic. slope_sigma_rad: standard deviation of the slopes; less than 0.05 counts as 0.05. Heights are integrated;
0 is the median where nothing touches.)")
      .def_static("from_height", &surface_of_height, py::arg("height_mm"), py::arg("contact"),
                  py::arg("pixel_pitch_mm"), py::kw_only(), py::arg("slope_sigma_rad") = kBestSlopeSigmaRad,
                  R"(The same of heights.

height_mm: HxW, 0 where nothing touches, negative in contact. Normals are those of its central differences; smooth noisy
heights first.)")
      .def_property_readonly(
          "height_mm", [](const py::object& self) { return map_view(self, maps_of(self).height_mm); },
          "HxW float32, mm: about 0 where nothing touches (a gel may be domed), negative in contact.")
      .def("points_mm", &points_of, "HxWx3 float32, mm: the point of the sensor frame that each pixel shows.")
      .def_property_readonly(
          "normals", [](const py::object& self) { return map_view(self, maps_of(self).normals); },
          "HxWx3 float32: unit normals (x, y, z), z > 0.")
      .def_property_readonly(
          "curvature", [](const py::object& self) { return map_view(self, maps_of(self).curvature); },
          "HxW float32, 1/pixel: smoothed Laplacian of the height, 0 outside contact.")
      .def_property_readonly("contact", &contact_of, "HxW bool: where the object touches.")
      .def_property_readonly("sigma", &sigma_of,
                             "HxW float32, rad: standard deviation of the slopes; inf outside contact.")
      .def_property_readonly(
          "contact_pixels", [](const TouchedSurface& self) { return self.maps->contact_pixels; },
          "Number of pixels in contact.")
      .def_property_readonly(
          "pixel_pitch_mm", [](const TouchedSurface& self) { return self.maps->pixel_pitch_mm; },
          "Millimeters per pixel.")
      .def_property_readonly(
          "zero_is_bare_gel", [](const TouchedSurface& self) { return self.maps->zero_is_bare_gel; },
          "False: no bare gel was seen, and heights are right among themselves only.")
      .def(py::pickle(&pickled_surface, unpickler("Surface", &unpickled_surface)))
      .def("__reduce_ex__", &reduced)
      .def("__repr__", [](const TouchedSurface& self) {
        return "<gelslam.Surface " + std::to_string(self.maps->height_mm.cols) + "x" +
               std::to_string(self.maps->height_mm.rows) + ", " + std::to_string(self.maps->contact_pixels) +
               " pixels in contact>";
      });
}

/// Accepts an array, a list of arrays, or the name of an image file.
std::vector<Picture> background_of(const py::object& background) {
  if (py::isinstance<py::array>(background)) return {picture_of(background, "background")};
  if (py::isinstance<py::list>(background) || py::isinstance<py::tuple>(background)) {
    std::vector<Picture> pictures;
    for (const py::handle picture : background)
      pictures.push_back(picture_of(py::reinterpret_borrow<py::object>(picture), "background"));
    if (pictures.empty()) throw Error("background: an empty list of pictures");
    return pictures;
  }
  try {
    return {{py::array(), read_image(background.cast<std::filesystem::path>())}};
  } catch (const py::cast_error&) {
    throw py::type_error("background: expected a picture (array), a list of pictures, or an image's name");
  }
}

std::shared_ptr<Sensor> make_sensor(const OptionalPath& model, const py::object& background,
                                    const OptionalPath& config, bool follow_light) {
  const std::vector<Picture> pictures = background_of(background);
  std::vector<cv::Mat3b> bgr;
  for (const Picture& picture : pictures) bgr.push_back(picture.bgr);
  std::shared_ptr<Sensor> sensor;
  {
    const WithoutGil release;
    Config settings = config_of(config, model);
    settings.surface.compensate_light = settings.surface.compensate_light && follow_light;
    sensor = std::make_shared<Sensor>(settings, bgr);
  }
  for (const std::string& warning : sensor->warnings()) warn(warning);
  return sensor;
}

std::shared_ptr<Sensor> sensor_of_surfaces(int width_px, int height_px, double pixel_pitch_mm) {
  if (width_px < 1 || height_px < 1 || !is_possible_picture({width_px, height_px}, pixel_pitch_mm))
    throw Error("no sensor has pictures of " + size_text(width_px, height_px) + " pixels and " +
                std::to_string(pixel_pitch_mm) + " mm per pixel");
  Config config;
  config.sensor.device_name = "surfaces";
  config.sensor.width_px = width_px;
  config.sensor.height_px = height_px;
  config.sensor.pixel_pitch_mm = config.surface.pixel_pitch_mm = pixel_pitch_mm;
  return std::make_shared<Sensor>(config);
}

void add_sensor(py::module_& module) {
  py::class_<Sensor, std::shared_ptr<Sensor>>(module, "Sensor", kOwnNew,
                                              R"(A tactile sensor: pictures become surfaces.

model: nnmodel.pth, a model of `gelslam calibrate`, or a log that holds one.
background: a picture of the bare gel (HxWx3 uint8, BGR), a list of such pictures (their mean counts), or an image's
name. config: a configuration file; default: GelSight Mini.

What makes the background doubtful (another sensor's model, too dark, dirt) is given as a warning. Pictures larger
than the configuration's size are cropped and resized as those of a camera are. The sensor follows slow changes of the
light: give it pictures in the order in which they were taken; the same picture twice gives heights that differ a
little. follow_light=False: the light stays that of the background, and a surface depends on its picture alone; a
picture in another light is warned of.
Threads that call it wait for each other.)")
      .def(py::init(&make_sensor), py::arg("model") = py::none(), py::kw_only(), py::arg("background"),
           py::arg("config") = py::none(), py::arg("follow_light") = true)
      .def_static(
          "of_surfaces", &sensor_of_surfaces, py::arg("width_px"), py::arg("height_px"),
          py::arg("pixel_pitch_mm"),
          "For Slam and Localizer of surfaces that other software measured (Surface.from_normals): it "
          "reads no pictures.")
      .def(
          "__call__",
          [](Sensor& self, const py::object& image) {
            const Picture picture = picture_of(image, "image");
            const WithoutGil release;
            return self.estimate(picture.bgr, "image");
          },
          py::arg("image"), "The Surface that a picture shows (HxWx3 uint8, BGR).")
      .def_property_readonly(
          "background", [](const Sensor& self) { return array_of(self.background().clone()); },
          "HxWx3 uint8, BGR: the bare gel, a copy.")
      .def_property_readonly(
          "pixel_pitch_mm", [](const Sensor& self) { return self.config().surface.pixel_pitch_mm; },
          "Millimeters per pixel.")
      .def_property_readonly("warnings", &Sensor::warnings,
                             "list of str: what is wrong with the background. Also given as Python warnings.")
      .def_property_readonly("doubts", &Sensor::warnings, "The warnings, by their older name.");
}

}  // namespace

void bind_surface(py::module_& module) {
  add_surface(module);
  add_sensor(module);
}

}  // namespace gelslam::python
