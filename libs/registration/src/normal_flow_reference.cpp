// Computes once per keyframe what inverse compositional registration needs of the reference (Baker &
// Matthews, IJCV 2004; Huang et al., NormalFlow, RA-L 2024): samples of the contact with their points, their
// normals, and the gradients of the normals by Sobel filters. The weight of a sample is its confidence times
// (tanh(s / kRimWidthMm - 1) + 1) / 2, where s is its distance from the border of the contact. The selection
// of samples is not in the papers.

#include "normal_flow_reference.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/lru_cached.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

using registration::detail::normal_gradient;
using registration::detail::NormalGradient;
using registration::detail::Samples;

/// Selects the pixels of the contact that are used as samples, in raster order. One half are those with the
/// largest absolute curvature, which determine x, y and twist. The other half are spread evenly over the rest
/// of the contact; they determine the tilt, and prevent that a speck of dirt dominates the result.
std::vector<cv::Point> select_samples(const Surface& surface, int max_samples) {
  std::vector<cv::Point> candidates;
  std::vector<float> bend;
  candidates.reserve(static_cast<std::size_t>(surface.contact_pixels));
  bend.reserve(candidates.capacity());
  for (int v = 1; v + 1 < surface.contact.rows; ++v)
    for (int u = 1; u + 1 < surface.contact.cols; ++u)
      if (is_read(surface, {u, v})) {
        candidates.emplace_back(u, v);
        bend.push_back(std::fabs(surface.curvature(v, u)));
      }
  const auto wanted = static_cast<std::size_t>(max_samples);
  if (candidates.size() <= wanted) return candidates;

  const std::size_t bent = wanted / 2, even = wanted - bent, rest = candidates.size() - bent;
  std::vector<float> ordered = bend;
  std::nth_element(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(bent), ordered.end(),
                   std::greater<>());
  const float limit = ordered[bent];
  // The number of pixels with exactly this curvature that still belong to the first half.
  auto at_limit = static_cast<std::ptrdiff_t>(bent) -
                  std::count_if(bend.begin(), bend.end(), [&](float c) { return c > limit; });
  std::vector<cv::Point> selected;
  selected.reserve(wanted);
  std::size_t rest_index = 0, rest_selected = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const bool is_bent = bend[i] > limit || (bend[i] == limit && at_limit-- > 0);
    // The remaining pixels are divided into `even` parts of equal size, and the middle one of each is
    // selected.
    if (is_bent || rest_index++ == (2 * rest_selected + 1) * rest / (2 * even)) {
      selected.push_back(candidates[i]);
      if (!is_bent) ++rest_selected;
    }
  }
  return selected;
}

}  // namespace

SelfSimilarityPtr make_self_similarity() { return std::make_shared<SelfSimilarity>(); }

NormalFlowReference::NormalFlowReference(SurfacePtr surface, const NormalFlowOptions& options,
                                         SelfSimilarityPtr self_similarity) {
  auto impl = std::make_unique<Impl>();
  impl->self_similarity = std::move(self_similarity);
  const std::vector<cv::Point> pixels = select_samples(*surface, options.max_samples);
  const cv::Mat1b& confidence = surface->confidence.empty() ? surface->contact : surface->confidence;
  constexpr double kRimWidthMm = 0.2536;
  const auto rim_px = static_cast<float>(kRimWidthMm / surface->pixel_pitch_mm);
  cv::Mat1f to_border_px;
  cv::distanceTransform(surface->contact, to_border_px, cv::DIST_L2, 3);
  const float pitch = static_cast<float>(surface->pixel_pitch_mm);
  const CameraModel camera = surface->camera();

  Samples& samples = impl->samples;
  samples.resize(pixels.size());
  impl->curvature.resize(pixels.size());
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const cv::Point p = pixels[k];
    const cv::Vec3f n = surface->normals(p);
    const Eigen::Vector2f px(static_cast<float>(p.x), static_cast<float>(p.y));
    const Eigen::Vector3f mm = camera.point_mm(camera.to_mm(px), surface->height_mm(p));
    samples.x[k] = mm.x();
    samples.y[k] = mm.y();
    samples.z[k] = mm.z();
    samples.nx[k] = n[0];
    samples.ny[k] = n[1];
    samples.nz[k] = n[2];
    // Near the border of the contact the gel is draped from the object to its level at rest, so normals there
    // have less weight. GelSLAM (Huang et al., T-RO 2026) weights its fusion by a similar function.
    const float rim = 0.5f * (std::tanh(to_border_px(p) / rim_px - 1.0f) + 1.0f);
    samples.weight[k] = rim * static_cast<float>(confidence(p)) * (1.0f / 255.0f);
    const NormalGradient gradient = normal_gradient(surface->normals, p);
    for (int c = 0; c < 3; ++c) {
      samples.gradient[static_cast<std::size_t>(c)][k] = gradient.dx[c] / pitch;
      samples.gradient[static_cast<std::size_t>(c + 3)][k] = gradient.dy[c] / pitch;
    }
    impl->curvature[k] = surface->curvature(p);
  }
  impl->surface = std::move(surface);
  impl_ = std::move(impl);
}

NormalFlowReference::~NormalFlowReference() = default;
NormalFlowReference::NormalFlowReference(NormalFlowReference&&) noexcept = default;

const Surface& NormalFlowReference::surface() const { return *impl_->surface; }
int NormalFlowReference::sample_count() const { return impl_->samples.size(); }

double NormalFlowReference::self_similarity() const {
  SelfSimilarity& of_surface = *impl_->self_similarity;
  std::call_once(of_surface.once, [&] { of_surface.value = gelslam::self_similarity(*impl_->surface); });
  return of_surface.value;
}

struct StoredReference::Entry {
  /// The given reference. If it is null, the members below are used.
  std::shared_ptr<const NormalFlowReference> ready;
  StoredSurface surface;
  NormalFlowOptions options;
  SelfSimilarityPtr self_similarity = make_self_similarity();  ///< expensive to compute, and kept for this
  LruCached<NormalFlowReference> made;                         ///< takes 0.5 MB, and the unpacked surface
};

StoredReference::StoredReference(std::shared_ptr<const NormalFlowReference> ready) {
  if (!ready) return;
  entry_ = std::make_shared<Entry>();
  entry_->ready = std::move(ready);
}

StoredReference::StoredReference(StoredSurface surface, const NormalFlowOptions& options)
    : entry_(std::make_shared<Entry>()) {
  entry_->surface = std::move(surface);
  entry_->options = options;
}

std::shared_ptr<const NormalFlowReference> StoredReference::get() const {
  if (entry_->ready) return entry_->ready;
  return entry_->made.get([this] {
    return std::make_shared<const NormalFlowReference>(entry_->surface.get(), entry_->options,
                                                       entry_->self_similarity);
  });
}

}  // namespace gelslam
