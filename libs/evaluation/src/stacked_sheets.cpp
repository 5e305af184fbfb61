#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <span>

#include "gelslam/core/parallel.hpp"
#include "gelslam/evaluation/mesh_metrics.hpp"

namespace gelslam {
namespace {

constexpr int kSheetSamples = 50'000;
constexpr std::uint64_t kSheetSeed = 4;
constexpr std::size_t kSamplesAtOnce = 4096;
/// Triangles a sample may look at on average; a ball of 0.5 mm holds some hundred of a usual mesh. Judged by
/// a few samples, before all are searched.
constexpr std::size_t kMaxTriangles = 10'000;
constexpr std::size_t kJudgedSamples = 64;
constexpr double kSameOrientationCosine = 0.5;

/// Which triangles meet at a vertex; vertices at the same place count as one, so that files without shared
/// vertices (STL) are connected too.
class Neighborhood {
 public:
  explicit Neighborhood(const Mesh& mesh) : place_(welded(mesh.vertices_mm)) {
    begin_.assign(mesh.vertices_mm.size() + 1, 0);
    for (const Eigen::Vector3i& triangle : mesh.triangles) {
      for (const int vertex : triangle) ++begin_[place(vertex) + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
    triangles_.resize(begin_.back());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const int vertex : mesh.triangles[t]) triangles_[next[place(vertex)]++] = static_cast<int>(t);
    }
  }

  std::size_t place(int vertex) const { return place_[static_cast<std::size_t>(vertex)]; }

  std::span<const int> triangles_at(int vertex) const {
    const std::size_t p = place(vertex);
    return std::span(triangles_).subspan(begin_[p], begin_[p + 1] - begin_[p]);
  }

 private:
  static std::vector<std::size_t> welded(const std::vector<Eigen::Vector3f>& vertices) {
    std::vector<std::size_t> order(vertices.size()), place(vertices.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return std::lexicographical_compare(vertices[a].begin(), vertices[a].end(), vertices[b].begin(),
                                          vertices[b].end());
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool same = i > 0 && vertices[order[i]] == vertices[order[i - 1]];
      place[order[i]] = same ? place[order[i - 1]] : order[i];
    }
    return place;
  }

  std::vector<std::size_t> place_, begin_;
  std::vector<int> triangles_;
};

/// Looks for other sheets; keeps its marks between samples, so one per thread.
class SheetSearch {
 public:
  SheetSearch(const TriangleScene& scene, const Neighborhood& neighborhood, double reach_mm)
      : scene_(scene),
        neighborhood_(neighborhood),
        reach_mm_(reach_mm),
        mark_(scene.mesh().triangles.size(), 0) {}

  bool finds_another(const SurfaceSample& sample) {
    const Eigen::Vector3d normal = scene_.triangle_normal(sample.triangle);
    auto hits = scene_.cast_all(sample.point_mm - reach_mm_ * normal, normal, 2.0 * reach_mm_);
    visits_ += hits.size();
    std::erase_if(hits, [&](const RayHit& hit) {
      return hit.triangle == sample.triangle ||
             scene_.triangle_normal(hit.triangle).dot(normal) < kSameOrientationCosine;
    });
    if (hits.empty()) return false;
    mark_own_sheet(sample);
    return std::any_of(hits.begin(), hits.end(), [&](const RayHit& hit) { return !is_marked(hit.triangle); });
  }

  std::size_t visits() const { return visits_; }  ///< triangles it has looked at

 private:
  bool is_marked(int triangle) const { return mark_[static_cast<std::size_t>(triangle)] == stamp_; }

  void mark(int triangle) {
    ++visits_;
    mark_[static_cast<std::size_t>(triangle)] = stamp_;
    open_.push_back(triangle);
  }

  /// Everything connected with the sample's triangle inside the ball of the reach, and its direct neighbors.
  void mark_own_sheet(const SurfaceSample& sample) {
    ++stamp_;
    mark(sample.triangle);
    while (!open_.empty()) {
      const int triangle = open_.back();
      open_.pop_back();
      for (const int vertex : scene_.mesh().triangles[static_cast<std::size_t>(triangle)]) {
        const Eigen::Vector3f& position = scene_.mesh().vertices_mm[static_cast<std::size_t>(vertex)];
        const bool within = (position.cast<double>() - sample.point_mm).norm() <= reach_mm_;
        if (!within && triangle != sample.triangle) continue;
        for (const int neighbor : neighborhood_.triangles_at(vertex)) {
          if (!is_marked(neighbor)) mark(neighbor);
        }
      }
    }
  }

  const TriangleScene& scene_;
  const Neighborhood& neighborhood_;
  double reach_mm_;
  std::vector<int> mark_;
  std::vector<int> open_;
  int stamp_ = 0;
  std::size_t visits_ = 0;
};

}  // namespace

double stacked_share(const TriangleScene& mesh, double reach_mm) {
  const auto samples = sample_surface(mesh.mesh(), kSheetSamples, kSheetSeed);
  const Neighborhood neighborhood(mesh.mesh());
  std::vector<char> stacked(samples.size());
  SheetSearch trial(mesh, neighborhood, reach_mm);
  for (std::size_t i = 0; i < samples.size(); i += 1 + samples.size() / kJudgedSamples) {
    trial.finds_another(samples[i]);
    if (trial.visits() > kMaxTriangles * kJudgedSamples) throw_too_tangled();
  }
  parallel_for_ranges(samples.size(), kSamplesAtOnce, 0, [&](std::size_t begin, std::size_t end) {
    SheetSearch search(mesh, neighborhood, reach_mm);
    for (std::size_t i = begin; i < end; ++i) stacked[i] = search.finds_another(samples[i]) ? 1 : 0;
  });
  return static_cast<double>(std::count(stacked.begin(), stacked.end(), 1)) /
         static_cast<double>(samples.size());
}

}  // namespace gelslam
