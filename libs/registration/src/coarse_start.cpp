// Finds initial poses for NormalFlow when the motion is unknown. This search is not in the papers; the masked
// correlation is that of Padfield (IEEE TIP 2012).
//
// Input: the curvature maps of both surfaces at a quarter of the resolution, minus their means over the
// contacts. The map of the reference is rotated by 2 kTwistSteps + 1 angles around the expected twist. Each
// rotated map is correlated with that of the target at all shifts at once, by FFT: the normalized
// cross-correlation over the pixels that both contacts cover. The maxima with enough shared pixels and at
// least half of the texture correlation that verification requires are candidates. At most kMaxCandidates are
// returned, the highest first, without those that are within one step of twist and kMinPeriodMm of a higher
// one.
//
// At each candidate, the tilt w follows from the normals that coincide, by n' = n + w x n to first order, and
// the translation from the centroids of the points that coincide. A faint texture has no maxima, and a
// periodic one has several, which the caller has to compare.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "gelslam/registration/relocalization.hpp"
#include "texture_spectrum.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;

constexpr double kTwistStepRad = 0.12;  // textures still agree at more than half of this angle
// The number of steps to each side of the expected twist. They cover two standard deviations of an unknown
// twist.
constexpr int kTwistSteps = static_cast<int>(2 * kMinPeriodMm / kMmPerRad / kTwistStepRad);
// The factor by which the resolution is reduced. Four pixels are a quarter of the shortest period
// (kMinPeriodMm), so the registration converges from the nearest of such pixels.
constexpr int kShrink = 4;
constexpr int kMaxCandidates = 6;  // more candidates would be periods of one texture

/// A twist and a shift after which the reference agrees with the target.
struct Candidate {
  int twist_step = 0;  // the number of steps from the expected twist
  double twist_rad = 0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  // in pixels of the reduced resolution
  double similarity = 0;                               // the normalized cross-correlation
};

/// Returns the signed shift that belongs to the index `shift` of a circular correlation of length `period`.
/// `size` is the length of the target's texture.
int wrapped(int shift, int size, int period) { return shift < size ? shift : shift - period; }

bool is_peak(const cv::Mat1f& map, int y, int x) {
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (map((y + dy + map.rows) % map.rows, (x + dx + map.cols) % map.cols) > map(y, x)) return false;
  return true;
}

/// Adds all local maxima of the correlation for one twist to `peaks`. `turned`: the rotated texture of the
/// reference.
void add_peaks(const CoarseTexture& turned, const CoarseTexture& target,
               const TextureSpectrum::Agreement& agreement, const Candidate& twist, double min_similarity,
               double min_shared_px, std::vector<Candidate>& peaks) {
  const cv::Mat1f& similarity = agreement.similarity;
  for (int y = 0; y < similarity.rows; ++y)
    for (int x = 0; x < similarity.cols; ++x) {
      if (similarity(y, x) < min_similarity || agreement.shared(y, x) < min_shared_px ||
          !is_peak(similarity, y, x))
        continue;
      Candidate& peak = peaks.emplace_back(twist);
      peak.shift_px = Eigen::Vector2d(wrapped(x, target.mask.cols, similarity.cols),
                                      wrapped(y, target.mask.rows, similarity.rows)) +
                      target.origin_px - turned.origin_px;
      peak.similarity = similarity(y, x);
    }
}

/// Returns the highest peaks in descending order. Peaks near a higher one are left out: those within one step
/// of twist and `min_distance_px`.
std::vector<Candidate> best_candidates(std::vector<Candidate> peaks, double min_distance_px) {
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Candidate& a, const Candidate& b) { return a.similarity > b.similarity; });
  std::vector<Candidate> candidates;
  for (const Candidate& peak : peaks) {
    if (static_cast<int>(candidates.size()) == kMaxCandidates) break;
    if (std::none_of(candidates.begin(), candidates.end(), [&](const Candidate& higher) {
          return std::abs(higher.twist_step - peak.twist_step) <= 1 &&
                 (higher.shift_px - peak.shift_px).norm() < min_distance_px;
        }))
      candidates.push_back(peak);
  }
  return candidates;
}

double twist_of(const Pose& pose) { return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)); }

Eigen::Vector3d vector(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

}  // namespace

Pose coarse_pose(const Surface& reference, const Surface& target, double twist_rad,
                 const Eigen::Vector2d& shift_mm) {
  const CameraModel camera = target.camera(), from = reference.camera();
  const Eigen::Matrix3d twist = Eigen::AngleAxisd(twist_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Eigen::Vector3d reference_sum = Eigen::Vector3d::Zero(), target_sum = Eigen::Vector3d::Zero();
  Eigen::Vector2d normal_change = Eigen::Vector2d::Zero();
  double weight = 0;
  int count = 0;
  for (int v = kShrink / 2; v < from.size.height; v += kShrink)
    for (int u = kShrink / 2; u < from.size.width; u += kShrink) {
      if (!reference.contact(v, u)) continue;
      const Eigen::Vector2d q = twist.topLeftCorner<2, 2>() * from.to_mm(cv::Point(u, v)) + shift_mm;
      const std::optional<cv::Point> at = camera.pixel_of(camera.to_px(q));
      if (!at || !target.contact(*at)) continue;
      const Eigen::Vector3d normal = twist * vector(reference.normals(v, u));
      normal_change += normal.z() * (vector(target.normals(*at)) - normal).head<2>();
      weight += normal.z() * normal.z();
      reference_sum += reference.point_mm({u, v});
      target_sum += camera.point_mm(q, static_cast<double>(target.height_mm(*at)));
      ++count;
    }
  Pose start = Pose::Identity();
  start.linear() = twist;
  start.translation().head<2>() = shift_mm;
  if (count == 0) return start;
  // To first order, a small rotation w changes a normal by w x n.
  const Eigen::Vector3d tilt(-normal_change.y() / weight, normal_change.x() / weight, 0.0);
  start.linear() = so3_exp(tilt) * twist;
  start.translation() = (target_sum - start.linear() * reference_sum) / count;
  return start;
}

std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const VerificationOptions& options) {
  if (reference.contact.size() != target.contact.size() || reference.pixel_pitch_mm != target.pixel_pitch_mm)
    return {};
  const CoarseTexture texture(reference, kShrink), target_texture(target, kShrink);
  const double min_shared_px = options.curvature.min_scr * std::min(texture.pixels, target_texture.pixels);
  if (min_shared_px < 1) return {};
  // Before the registration the correlation is about half of that after it.
  const double min_similarity = options.min_texture_correlation / 2;
  std::vector<Candidate> twists;
  std::vector<CoarseTexture> turned;
  cv::Size size;
  for (int step = -kTwistSteps; step <= kTwistSteps; ++step) {
    twists.push_back({.twist_step = step, .twist_rad = twist_of(expected) + step * kTwistStepRad});
    const cv::Size own = turned.emplace_back(texture.turned(twists.back().twist_rad)).mask.size();
    size = {std::max(size.width, own.width), std::max(size.height, own.height)};
  }
  size += target_texture.mask.size();
  const TextureSpectrum target_spectrum(target_texture, size);
  std::vector<Candidate> peaks;
  for (std::size_t i = 0; i < turned.size(); ++i)
    add_peaks(turned[i], target_texture, TextureSpectrum(turned[i], size).correlated_with(target_spectrum),
              twists[i], min_similarity, min_shared_px, peaks);
  std::vector<Pose> starts;
  for (const Candidate& candidate : best_candidates(std::move(peaks), kMinPeriodMm / texture.pixel_pitch_mm))
    starts.push_back(
        coarse_pose(reference, target, candidate.twist_rad, candidate.shift_px * texture.pixel_pitch_mm));
  return starts;
}

}  // namespace gelslam
