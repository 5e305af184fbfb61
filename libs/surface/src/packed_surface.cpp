// Packs surfaces for memory and files: the maps are quantized, predicted from their neighbors as in JPEG-LS
// (Weinberger et al. 2000), and compressed with zlib. docs/file-formats.md describes the layout.

#include "gelslam/surface/packed_surface.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

constexpr std::string_view kMagic = "GELSURF2";
constexpr std::size_t kShortPlanes = 4;   // nx, ny, height, curvature
constexpr std::size_t kCoarsePlanes = 3;  // nx, ny, height
constexpr int kCellPx = 4;

/// The header follows the magic number and the checksum, which covers everything behind it. Numbers are
/// little-endian, as on all machines for which the program is built.
struct PackedHeader {
  std::uint16_t width = 0, height = 0;
  std::uint16_t box_x = 0, box_y = 0, box_width = 0, box_height = 0;
  std::uint8_t zero_is_bare_gel = 0, has_confidence = 0;
  std::uint16_t has_optics = 0;  ///< 1 if the members of SensorOptics follow the header, in their order
  std::uint32_t contact_pixels = 0;
  float slope_sigma_ratio = 1, slope_noise_ratio = 1;
  float center_x_mm = 0, center_y_mm = 0;
  std::uint32_t reserved = 0;
  double pixel_pitch_mm = 0;
};
static_assert(sizeof(PackedHeader) == 48);

constexpr std::size_t kHeaderAt = kMagic.size() + sizeof(std::uint32_t);
constexpr std::size_t kHeaderEnd = kHeaderAt + sizeof(PackedHeader);
static_assert(sizeof(SensorOptics) == 7 * sizeof(double));

PackedHeader header_of(const std::string& bytes) {
  PackedHeader header;
  std::memcpy(&header, bytes.data() + kHeaderAt, sizeof header);
  return header;
}

SurfaceFacts facts_in(const std::string& bytes) {
  const PackedHeader header = header_of(bytes);
  return {{header.width, header.height},
          header.pixel_pitch_mm,
          static_cast<double>(header.slope_sigma_ratio),
          static_cast<int>(header.contact_pixels),
          {header.center_x_mm, header.center_y_mm}};
}

std::size_t stream_at(const PackedHeader& header) {
  return kHeaderEnd + (header.has_optics ? sizeof(SensorOptics) : 0);
}

SensorOptics optics_of(const std::string& bytes) {
  SensorOptics optics;
  if (header_of(bytes).has_optics) std::memcpy(&optics, bytes.data() + kHeaderEnd, sizeof optics);
  return optics;
}

cv::Rect box_of(const PackedHeader& h) { return {h.box_x, h.box_y, h.box_width, h.box_height}; }

std::int16_t steps(float value, float step) {
  constexpr float kMax = 32767.0F;
  const float number = std::clamp(value / step, -kMax, kMax);
  return static_cast<std::int16_t>(number +
                                   std::copysign(0.5F, number));  // std::lround() is a call per pixel
}

/// Predicts a value from its three neighbors that are decoded already, by the median edge detector of
/// JPEG-LS.
int predicted(int left, int above, int corner) {
  if (corner >= std::max(left, above)) return std::min(left, above);
  if (corner <= std::min(left, above)) return std::max(left, above);
  return left + above - corner;
}

/// Calls visit(value, prediction) for every pixel, row by row. `visit` may set the value.
template <typename Visit>
void predict_all(cv::Mat_<std::int16_t>& plane, Visit&& visit) {
  for (int v = 0; v < plane.rows; ++v) {
    std::int16_t* const row = plane[v];
    const std::int16_t* const above = v > 0 ? plane[v - 1] : nullptr;
    for (int u = 0; u < plane.cols; ++u)
      if (u > 0)
        visit(row[u], above ? predicted(row[u - 1], above[u], above[u - 1]) : row[u - 1]);
      else
        visit(row[u], above ? above[0] : 0);
  }
}

/// Appends a plane to the uncompressed bytes: the differences between the values and their predictions,
/// mapped to unsigned numbers so that small differences of either sign become small numbers. The low bytes of
/// all pixels come first, then the high bytes.
void append_plane(cv::Mat_<std::int16_t>& plane, std::string& planes) {
  const std::size_t pixels = plane.total();
  planes.resize(planes.size() + 2 * pixels);
  char *low = planes.data() + planes.size() - 2 * pixels, *high = low + pixels;
  predict_all(plane, [&](const std::int16_t& value, int prediction) {
    const auto difference = static_cast<std::int16_t>(value - prediction);
    const auto folded = static_cast<std::uint16_t>((difference * 2) ^ (difference >> 15));
    *low++ = static_cast<char>(folded & 0xFF);
    *high++ = static_cast<char>(folded >> 8);
  });
}

cv::Mat_<std::int16_t> read_plane(const std::string& planes, std::size_t begin, cv::Size size) {
  cv::Mat_<std::int16_t> plane(size);
  const auto* low = reinterpret_cast<const std::uint8_t*>(planes.data()) + begin;
  const auto* high = low + plane.total();
  predict_all(plane, [&](std::int16_t& value, int prediction) {
    const int folded = *low++ | *high++ << 8;
    value = static_cast<std::int16_t>(prediction + ((folded >> 1) ^ -(folded & 1)));
  });
  return plane;
}

/// Returns the bounding box of the contact, enlarged to whole cells and by one cell on each side.
cv::Rect detailed_box(const cv::Mat1b& contact) {
  const cv::Rect box = cv::boundingRect(contact);
  if (box.empty()) return {};
  const cv::Point begin(box.x / kCellPx - 1, box.y / kCellPx - 1),
      end((box.br().x - 1) / kCellPx + 2, (box.br().y - 1) / kCellPx + 2);
  return cv::Rect(kCellPx * begin, kCellPx * end) & cv::Rect({}, contact.size());
}

cv::Size cells_of(cv::Size size) {
  return {(size.width + kCellPx - 1) / kCellPx, (size.height + kCellPx - 1) / kCellPx};
}

cv::Rect cell_at(int column, int row, cv::Size size) {
  return cv::Rect(kCellPx * column, kCellPx * row, kCellPx, kCellPx) & cv::Rect({}, size);
}

/// Appends the coarse planes: means over the cells outside the box, where the gel is smooth.
void append_coarse_planes(const Surface& surface, const cv::Rect& box, std::string& planes) {
  const cv::Size size = surface.contact.size(), cells = cells_of(size);
  cv::Mat_<std::int16_t> nx(cells, 0), ny(cells, 0), height(cells, 0);
  for (int v = 0; v < cells.height; ++v)
    for (int u = 0; u < cells.width; ++u) {
      const cv::Rect cell = cell_at(u, v, size);
      if (box.contains(cell.tl())) continue;
      cv::Vec3d normal(0, 0, 0);
      double height_mm = 0;
      for (int y = cell.y; y < cell.br().y; ++y)
        for (int x = cell.x; x < cell.br().x; ++x) {
          normal += surface.normals(y, x);
          height_mm += static_cast<double>(surface.height_mm(y, x));
        }
      const double share = 1.0 / cell.area();
      nx(v, u) = steps(static_cast<float>(normal[0] * share), PackedSurface::kCoarseNormalStep);
      ny(v, u) = steps(static_cast<float>(normal[1] * share), PackedSurface::kCoarseNormalStep);
      height(v, u) = steps(static_cast<float>(height_mm * share), PackedSurface::kCoarseHeightStepMm);
    }
  for (auto* plane : {&nx, &ny, &height}) append_plane(*plane, planes);
}

std::string planes_of(const Surface& surface, const cv::Rect& box, bool has_confidence) {
  cv::Mat_<std::int16_t> nx(box.size()), ny(box.size()), height(box.size()), curvature(box.size());
  for (int v = 0; v < box.height; ++v) {
    const cv::Vec3f* const normals = surface.normals[box.y + v] + box.x;
    const float *const heights_mm = surface.height_mm[box.y + v] + box.x, *const curvatures =
                                                                              surface.curvature[box.y + v] +
                                                                              box.x;
    const std::uint8_t* const contact = surface.contact[box.y + v] + box.x;
    for (int u = 0; u < box.width; ++u) {
      nx(v, u) = steps(normals[u][0], PackedSurface::kNormalStep);
      ny(v, u) = steps(normals[u][1], PackedSurface::kNormalStep);
      height(v, u) = PackedSurface::height_steps(heights_mm[u]);
      curvature(v, u) = steps(contact[u] ? curvatures[u] : 0, PackedSurface::kCurvatureStep);
    }
  }
  std::string planes;
  append_coarse_planes(surface, box, planes);
  for (auto* plane : {&nx, &ny, &height, &curvature}) append_plane(*plane, planes);
  const auto append_bytes = [&](const cv::Mat1b& map) {
    for (int v = 0; v < box.height; ++v)
      planes.append(reinterpret_cast<const char*>(&map(box.y + v, box.x)),
                    static_cast<std::size_t>(box.width));
  };
  append_bytes(surface.contact);
  if (has_confidence) append_bytes(surface.confidence);
  return planes;
}

std::size_t coarse_size(const PackedHeader& header) {
  return 2 * kCoarsePlanes * static_cast<std::size_t>(cells_of({header.width, header.height}).area());
}

std::size_t planes_size(const PackedHeader& header) {
  const std::size_t pixels = std::size_t{header.box_width} * header.box_height;
  return coarse_size(header) + pixels * (2 * kShortPlanes + 1 + (header.has_confidence ? 1 : 0));
}

/// Returns the unit normal with the given rounded components. If rounding has made them as long as a unit
/// vector, they are shortened, so that z remains positive and the slope finite.
cv::Vec3f normal_of(float x, float y) {
  const float z2 = 1.0F - x * x - y * y;
  if (z2 >= PackedSurface::kNormalStep) return {x, y, std::sqrt(z2)};
  return cv::normalize(cv::Vec3f(x, y, std::sqrt(PackedSurface::kNormalStep)));
}

void unpack_coarse(const std::string& planes, const cv::Rect& box, Surface& surface) {
  const cv::Size size = surface.contact.size(), cells = cells_of(size);
  const std::size_t bytes = 2 * static_cast<std::size_t>(cells.area());
  const auto nx = read_plane(planes, 0, cells), ny = read_plane(planes, bytes, cells),
             height = read_plane(planes, 2 * bytes, cells);
  for (int v = 0; v < cells.height; ++v)
    for (int u = 0; u < cells.width; ++u) {
      const cv::Rect cell = cell_at(u, v, size);
      if (box.contains(cell.tl())) continue;
      constexpr float kStep = PackedSurface::kCoarseNormalStep;
      const cv::Vec3f normal =
          normal_of(kStep * static_cast<float>(nx(v, u)), kStep * static_cast<float>(ny(v, u)));
      const float height_mm = PackedSurface::kCoarseHeightStepMm * static_cast<float>(height(v, u));
      for (int y = cell.y; y < cell.br().y; ++y) {
        std::fill_n(surface.normals[y] + cell.x, cell.width, normal);
        std::fill_n(surface.height_mm[y] + cell.x, cell.width, height_mm);
      }
    }
}

void unpack_box(const std::string& planes, std::size_t begin, const cv::Rect& box, Surface& surface) {
  const auto pixels = static_cast<std::size_t>(box.area());
  const auto short_plane = [&](std::size_t k) {
    return read_plane(planes, begin + 2 * k * pixels, box.size());
  };
  const auto byte_plane = [&](std::size_t k) {
    return cv::Mat1b(box.height, box.width,
                     reinterpret_cast<std::uint8_t*>(
                         const_cast<char*>(planes.data() + begin + (2 * kShortPlanes + k) * pixels)));
  };
  const auto nx = short_plane(0), ny = short_plane(1), height = short_plane(2), curvature = short_plane(3);
  byte_plane(0).copyTo(surface.contact(box));
  if (!surface.confidence.empty()) byte_plane(1).copyTo(surface.confidence(box));
  for (int v = 0; v < box.height; ++v)
    for (int u = 0; u < box.width; ++u) {
      const cv::Point p(box.x + u, box.y + v);
      surface.normals(p) = normal_of(PackedSurface::kNormalStep * static_cast<float>(nx(v, u)),
                                     PackedSurface::kNormalStep * static_cast<float>(ny(v, u)));
      surface.height_mm(p) = PackedSurface::kHeightStepMm * static_cast<float>(height(v, u));
      surface.curvature(p) = PackedSurface::kCurvatureStep * static_cast<float>(curvature(v, u));
    }
}

std::string deflated(const std::string& planes) {
  uLongf size = ::compressBound(static_cast<uLong>(planes.size()));
  std::string bytes(size, '\0');
  if (::compress2(reinterpret_cast<Bytef*>(bytes.data()), &size,
                  reinterpret_cast<const Bytef*>(planes.data()), static_cast<uLong>(planes.size()),
                  Z_BEST_SPEED) != Z_OK)
    throw std::bad_alloc();
  bytes.resize(size);
  return bytes;
}

std::string inflated(const std::string& bytes, std::size_t begin, std::size_t expected) {
  constexpr std::size_t kMaxInflation = 1100;  // the most that zlib can do; guards against damaged headers
  if (expected / kMaxInflation > bytes.size()) throw Error("damaged: its planes are incomplete");
  std::string planes(expected, '\0');
  uLongf size = static_cast<uLongf>(expected);
  const int code = ::uncompress(reinterpret_cast<Bytef*>(planes.data()), &size,
                                reinterpret_cast<const Bytef*>(bytes.data() + begin),
                                static_cast<uLong>(bytes.size() - begin));
  if (code != Z_OK || size != expected) throw Error("damaged: its planes are incomplete");
  return planes;
}

bool is_possible(const std::string& bytes) {
  const PackedHeader h = header_of(bytes);
  if (h.has_optics > 1 || bytes.size() < stream_at(h)) return false;
  if (!why_impossible(optics_of(bytes), h.width, h.height, h.pixel_pitch_mm).empty()) return false;
  const bool box = h.box_x + h.box_width <= h.width && h.box_y + h.box_height <= h.height;
  const bool center = std::isfinite(h.center_x_mm) && std::isfinite(h.center_y_mm);
  const auto sigma = [](float s) { return s > 0 && s <= 1000; };
  return is_possible_picture({h.width, h.height}, h.pixel_pitch_mm) && box && center &&
         sigma(h.slope_sigma_ratio) && sigma(h.slope_noise_ratio) && h.has_confidence <= 1 &&
         h.zero_is_bare_gel <= 1;
}

std::string packed(const Surface& surface) {
  const cv::Rect box = detailed_box(surface.contact);
  PackedHeader header;
  header.width = static_cast<std::uint16_t>(surface.contact.cols);
  header.height = static_cast<std::uint16_t>(surface.contact.rows);
  header.box_x = static_cast<std::uint16_t>(box.x);
  header.box_y = static_cast<std::uint16_t>(box.y);
  header.box_width = static_cast<std::uint16_t>(box.width);
  header.box_height = static_cast<std::uint16_t>(box.height);
  header.zero_is_bare_gel = surface.zero_is_bare_gel ? 1 : 0;
  header.has_confidence = surface.confidence.empty() ? 0 : 1;
  header.contact_pixels = static_cast<std::uint32_t>(surface.contact_pixels);
  header.pixel_pitch_mm = surface.pixel_pitch_mm;
  header.slope_sigma_ratio = static_cast<float>(surface.slope_sigma_ratio);
  header.slope_noise_ratio = static_cast<float>(surface.slope_noise_ratio);
  const Eigen::Vector2d center_mm = contact_center_mm(surface);
  header.center_x_mm = static_cast<float>(center_mm.x());
  header.center_y_mm = static_cast<float>(center_mm.y());

  header.has_optics = surface.optics == SensorOptics{} ? 0 : 1;
  std::string content(sizeof header, '\0');
  std::memcpy(content.data(), &header, sizeof header);
  if (header.has_optics)
    content.append(reinterpret_cast<const char*>(&surface.optics), sizeof surface.optics);
  content += deflated(planes_of(surface, box, header.has_confidence != 0));
  const std::uint32_t sum = crc32_of(content);
  std::string bytes(kMagic);
  bytes.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return bytes + content;
}

}  // namespace

SurfaceFacts facts_of(const Surface& surface) {
  return {surface.contact.size(), surface.pixel_pitch_mm, surface.slope_sigma_ratio, surface.contact_pixels,
          contact_center_mm(surface)};
}

PackedSurface::PackedSurface(std::string bytes)
    : facts_(facts_in(bytes)), bytes_(std::make_shared<const std::string>(std::move(bytes))) {}

PackedSurface::PackedSurface(const Surface& surface) : PackedSurface(packed(surface)) {}

PackedSurface PackedSurface::from_bytes(std::string bytes) {
  if (bytes.size() < kHeaderEnd || !bytes.starts_with(kMagic))
    throw Error("damaged, or not a packed surface");
  std::uint32_t sum = 0;
  std::memcpy(&sum, bytes.data() + kMagic.size(), sizeof sum);
  if (sum != crc32_of(std::string_view(bytes).substr(kHeaderAt)))
    throw Error("damaged: its checksum does not match");
  if (!is_possible(bytes)) throw Error("holds numbers that no surface has");
  return PackedSurface(std::move(bytes));
}

std::int16_t PackedSurface::height_steps(float height_mm) { return steps(height_mm, kHeightStepMm); }

SurfacePtr PackedSurface::unpack() const {
  const std::string& bytes = *bytes_;
  const PackedHeader header = header_of(bytes);
  const cv::Size size(header.width, header.height);
  const cv::Rect box = box_of(header);
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = header.pixel_pitch_mm;
  surface->optics = optics_of(bytes);
  surface->slope_sigma_ratio = facts_.slope_sigma_ratio;
  surface->slope_noise_ratio = static_cast<double>(header.slope_noise_ratio);
  surface->zero_is_bare_gel = header.zero_is_bare_gel != 0;
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b::zeros(size);
  surface->curvature = cv::Mat1f::zeros(size);
  if (header.has_confidence) surface->confidence = cv::Mat1b::zeros(size);
  const std::string planes = inflated(bytes, stream_at(header), planes_size(header));
  unpack_coarse(planes, box, *surface);
  if (!box.empty()) unpack_box(planes, coarse_size(header), box, *surface);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  if (surface->contact_pixels != facts_.contact_pixels) throw Error("holds numbers that no surface has");
  return surface;
}

}  // namespace gelslam
