#include "gelslam/registration/coarse_start.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/registration/texture_spectrum.hpp"

namespace gelslam {
namespace {

/// The reference turned by `twist_rad` and moved agrees with the target.
struct Place {
  double twist_rad = 0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  // of the coarse pixels
  double similarity = 0;
};

void most_alike_first(std::vector<Place>& places) {
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.similarity > b.similarity; });
}

int wrapped(int shift, int size) { return shift > size / 2 ? shift - size : shift; }

bool is_peak(const cv::Mat1f& map, int y, int x) {
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (map((y + dy + map.rows) % map.rows, (x + dx + map.cols) % map.cols) > map(y, x)) return false;
  return true;
}

/// The highest peaks of one twist that are not slopes of a higher one.
std::vector<Place> best_places(const TextureSpectrum::Agreement& agreement, double least_shared_px,
                               double least_distance_px, const CoarseStartOptions& options) {
  const cv::Mat1f& similarity = agreement.similarity;
  std::vector<Place> peaks;
  for (int y = 0; y < similarity.rows; ++y)
    for (int x = 0; x < similarity.cols; ++x)
      if (similarity(y, x) >= options.min_similarity && agreement.shared(y, x) >= least_shared_px &&
          is_peak(similarity, y, x))
        peaks.push_back({0, {wrapped(x, similarity.cols), wrapped(y, similarity.rows)}, similarity(y, x)});
  most_alike_first(peaks);
  std::vector<Place> places;
  for (const Place& peak : peaks) {
    if (static_cast<int>(places.size()) == options.places_per_twist) break;
    if (std::none_of(places.begin(), places.end(), [&](const Place& higher) {
          return (higher.shift_px - peak.shift_px).norm() < least_distance_px;
        }))
      places.push_back(peak);
  }
  return places;
}

double twist_of(const Pose& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

Eigen::Vector3d vector(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

/// Turns the reference as the place says, tilts it as the normals that meet there ask for, and lays the
/// points that meet there on each other.
Pose lift(const Place& place, const Surface& reference, const Surface& target, int shrink) {
  const double pitch = target.pixel_pitch_mm;
  const int width = target.contact.cols, height = target.contact.rows;
  const Eigen::Vector2d shift_mm = place.shift_px * shrink * pitch;
  const Eigen::Matrix3d twist =
      Eigen::AngleAxisd(place.twist_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Eigen::Vector3d reference_sum = Eigen::Vector3d::Zero(), target_sum = Eigen::Vector3d::Zero();
  Eigen::Vector2d gap = Eigen::Vector2d::Zero();
  double weight = 0;
  int count = 0;
  for (int v = shrink / 2; v < height; v += shrink)
    for (int u = shrink / 2; u < width; u += shrink) {
      if (!reference.contact(v, u)) continue;
      const Eigen::Vector2d p((u - 0.5 * width + 0.5) * pitch, (v - 0.5 * height + 0.5) * pitch);
      const Eigen::Vector2d q = twist.topLeftCorner<2, 2>() * p + shift_mm;
      const int tu = static_cast<int>(std::lround(q.x() / pitch + 0.5 * width - 0.5));
      const int tv = static_cast<int>(std::lround(q.y() / pitch + 0.5 * height - 0.5));
      if (tu < 0 || tv < 0 || tu >= width || tv >= height || !target.contact(tv, tu)) continue;
      const Eigen::Vector3d normal = twist * vector(reference.normals(v, u));
      gap += normal.z() * (vector(target.normals(tv, tu)) - normal).head<2>();
      weight += normal.z() * normal.z();
      reference_sum += Eigen::Vector3d(p.x(), p.y(), reference.height_mm(v, u));
      target_sum += Eigen::Vector3d(q.x(), q.y(), target.height_mm(tv, tu));
      ++count;
    }
  Pose start = Pose::Identity();
  start.linear() = twist;
  start.translation().head<2>() = shift_mm;
  if (count == 0) return start;
  // To first order a small turn w changes a normal by w x n.
  const Eigen::Vector3d tilt(-gap.y() / weight, gap.x() / weight, 0.0);
  start.linear() = so3_exp(tilt) * twist;
  start.translation() = (target_sum - start.linear() * reference_sum) / count;
  return start;
}

}  // namespace

std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const CoarseStartOptions& options) {
  const CoarseTexture texture(reference, options.shrink), target_texture(target, options.shrink);
  const double least_shared_px = options.min_shared * std::min(texture.pixels, target_texture.pixels);
  if (least_shared_px < 1) return {};
  const TextureSpectrum target_spectrum(target_texture);
  std::vector<Place> places;
  for (int step = -options.twist_steps; step <= options.twist_steps; ++step) {
    const double twist_rad = twist_of(expected) + step * options.twist_step_rad;
    const TextureSpectrum turned(texture.turned(twist_rad));
    for (Place place : best_places(turned.laid_on(target_spectrum), least_shared_px,
                                   options.least_distance_mm / texture.pixel_pitch_mm, options)) {
      place.twist_rad = twist_rad;
      places.push_back(place);
    }
  }
  most_alike_first(places);
  places.resize(std::min(places.size(), static_cast<std::size_t>(options.max_starts)));
  std::vector<Pose> starts;
  for (const Place& place : places) starts.push_back(lift(place, reference, target, options.shrink));
  return starts;
}

}  // namespace gelslam
