#include "gelslam/viewer/guidance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "live/point_bits.hpp"

namespace gelslam {
namespace {

using namespace viewer::detail;
using Eigen::Vector3f;

constexpr double kMinHoleMm2 = 2;     ///< smaller ones are pits that the gel does not reach
constexpr double kLoopDriftMm = 0.1;  ///< two standard deviations: from here on a loop is worth the way
constexpr double kBetterKnown = 0.5;  ///< share of the present uncertainty at which a place closes a loop
constexpr float kShortCut = 0.5F;     ///< share of the way back that a loop may be long
constexpr float kTargetReachMm = 4;   ///< border that counts as the same target
constexpr float kSteadiness = 2;      ///< how much longer the way to the last target may be

/// Border edges by where they begin.
using EdgesByStart = std::unordered_multimap<PointBits, const MeshBorder::Edge*, PointBitsHash>;

/// Another edge leads back: two blocks meet there.
bool is_seam(const MeshBorder::Edge& edge, const EdgesByStart& all) {
  const auto [first, last] = all.equal_range(bits_of(edge.to_mm));
  return std::any_of(
      first, last, [&](const auto& entry) { return bits_of(entry.second->to_mm) == bits_of(edge.from_mm); });
}

Vector3f middle(const MeshBorder::Edge& edge) { return 0.5F * (edge.from_mm + edge.to_mm); }

/// Of the triangles from the loop's middle to its edges. A loop that runs around two openings (a band that is
/// not closed yet) would have nearly no vector area.
double fan_area_mm2(const std::vector<MeshBorder::Edge>& edges) {
  Vector3f center = Vector3f::Zero();
  float length = 0;
  for (const MeshBorder::Edge& edge : edges) {
    const float weight = (edge.to_mm - edge.from_mm).norm();
    center += weight * middle(edge), length += weight;
  }
  center /= length;
  double sum = 0;
  for (const MeshBorder::Edge& edge : edges)
    sum += 0.5 * static_cast<double>((edge.from_mm - center).cross(edge.to_mm - center).norm());
  return sum;
}

/// The border's middle around the edge nearest to a place, a little beyond the surface.
std::optional<Vector3f> nearest_border(const std::vector<MeshBorder::Loop>& loops, const Vector3f& place_mm) {
  const MeshBorder::Edge* nearest = nullptr;
  float distance2 = std::numeric_limits<float>::infinity();
  for (const MeshBorder::Loop& loop : loops)
    for (const MeshBorder::Edge& edge : loop.edges)
      if (const float d2 = (middle(edge) - place_mm).squaredNorm(); d2 < distance2)
        distance2 = d2, nearest = &edge;
  if (nearest == nullptr) return std::nullopt;
  Vector3f sum = Vector3f::Zero(), outward = Vector3f::Zero();
  float length = 0;
  for (const MeshBorder::Loop& loop : loops)
    for (const MeshBorder::Edge& edge : loop.edges) {
      const float weight = (edge.to_mm - edge.from_mm).norm();
      if ((middle(edge) - middle(*nearest)).norm() > kTargetReachMm || edge.outward.dot(nearest->outward) < 0)
        continue;
      sum += weight * middle(edge), outward += weight * edge.outward, length += weight;
    }
  return length > 0 ? Vector3f(sum / length + outward.normalized()) : middle(*nearest);
}

/// The middle of what a keyframe touches.
Vector3f place_of(const MapSnapshot::Node& node) {
  const Eigen::Vector2d center_mm =
      node.surface ? node.surface.contact_center_mm() : Eigen::Vector2d(Eigen::Vector2d::Zero());
  return (node.component_T_keyframe * Eigen::Vector3d(center_mm.x(), center_mm.y(), 0)).cast<float>();
}

/// The nearest place that is known much better than the one touched, and that is nearer than the way by which
/// the sensor came from there: going there closes a loop instead of going back.
std::optional<Vector3f> nearest_known_place(const MapSnapshot& map, const Vector3f& touch_mm) {
  std::vector<const MapSnapshot::Node*> known;
  std::vector<Vector3f> places;
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.sigma_mm < 0) continue;
    known.push_back(&node);
    places.push_back(place_of(node));
  }
  std::size_t here = 0;
  for (std::size_t i = 1; i < places.size(); ++i)
    if ((places[i] - touch_mm).norm() < (places[here] - touch_mm).norm()) here = i;
  if (known.empty() || 2 * known[here]->sigma_mm < kLoopDriftMm) return std::nullopt;
  std::optional<Vector3f> best;
  float way_mm = 0;
  for (std::size_t i = here; i-- > 0;) {
    way_mm += (places[i + 1] - places[i]).norm();
    const float distance_mm = (places[i] - touch_mm).norm();
    if (known[i]->sigma_mm > kBetterKnown * known[here]->sigma_mm || distance_mm > kShortCut * way_mm)
      continue;
    if (!best || distance_mm < (*best - touch_mm).norm()) best = places[i];
  }
  return best;
}

}  // namespace

void MeshBorder::update(const MeshBlocks& blocks) {
  std::erase_if(blocks_, [&](const auto& entry) { return !blocks.contains(entry.first); });
  for (const auto& [key, mesh] : blocks) {
    Block& block = blocks_[key];
    if (block.mesh != mesh) block = border_of(mesh);
  }
}

MeshBorder::Block MeshBorder::border_of(const std::shared_ptr<const Mesh>& mesh) {
  struct Side {
    std::pair<int, int> ends;  // the smaller first
    int from, to, inner;
  };
  const auto& vertices = mesh->vertices_mm;
  const auto at = [&](int i) -> const Vector3f& { return vertices[static_cast<std::size_t>(i)]; };
  Block block{mesh, {}, 0};
  std::vector<Side> sides;
  for (const Eigen::Vector3i& t : mesh->triangles) {
    if (t.minCoeff() < 0 || t.maxCoeff() >= static_cast<int>(vertices.size())) continue;
    block.area_mm2 += 0.5 * static_cast<double>((at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).norm());
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      sides.push_back({std::minmax(a, b), a, b, t[(k + 2) % 3]});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.ends < b.ends; });
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i > 0 && sides[i - 1].ends == sides[i].ends) continue;
    if (i + 1 < sides.size() && sides[i + 1].ends == sides[i].ends) continue;
    const Vector3f &from = at(sides[i].from), &to = at(sides[i].to);
    const Vector3f along = (to - from).normalized(), across = from - at(sides[i].inner);
    const Vector3f outward = (across - along.dot(across) * along).normalized();
    if (along.allFinite() && outward.allFinite()) block.edges.push_back({from, to, outward});
  }
  return block;
}

double MeshBorder::area_mm2() const {
  double sum = 0;
  for (const auto& [key, block] : blocks_) sum += block.area_mm2;
  return sum;
}

std::vector<MeshBorder::Loop> MeshBorder::loops(double min_hole_mm2) const {
  EdgesByStart by_start, waiting;
  for (const auto& [key, block] : blocks_)
    for (const Edge& edge : block.edges) by_start.emplace(bits_of(edge.from_mm), &edge);
  std::vector<const Edge*> border;
  for (const auto& [key, block] : blocks_)
    for (const Edge& edge : block.edges)
      if (!is_seam(edge, by_start)) border.push_back(&edge);
  for (const Edge* edge : border) waiting.emplace(bits_of(edge->from_mm), edge);
  std::vector<Loop> loops;
  for (const Edge* first : border) {
    Loop loop;
    for (PointBits at = bits_of(first->from_mm);;) {
      const auto next = waiting.find(at);
      if (next == waiting.end()) break;
      loop.edges.push_back(*next->second);
      at = bits_of(next->second->to_mm);
      waiting.erase(next);
    }
    if (loop.edges.empty()) continue;
    loop.hole_mm2 = fan_area_mm2(loop.edges);
    if (loop.hole_mm2 >= min_hole_mm2) loops.push_back(std::move(loop));
  }
  std::sort(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) { return a.hole_mm2 > b.hole_mm2; });
  return loops;
}

Guidance guide(const MeshBorder& border, const MapSnapshot& map, const Vector3f& touch_mm,
               const std::optional<Guidance::Target>& last) {
  Guidance result;
  const double area_mm2 = result.area_mm2 = border.area_mm2();
  if (area_mm2 <= 0) return result;
  result.holes = border.loops(kMinHoleMm2);
  double open_mm2 = 0;
  for (const MeshBorder::Loop& loop : result.holes) open_mm2 += loop.hole_mm2;
  result.closed_share = area_mm2 / (area_mm2 + open_mm2);
  for (const MapSnapshot::Node& node : map.nodes)
    if (node.sigma_mm >= 0) result.drift_mm = std::max(result.drift_mm.value_or(0), 2 * node.sigma_mm);
  if (const auto known = nearest_known_place(map, touch_mm)) {
    result.target = Guidance::Target{Guidance::Reason::drift, *known};
    return result;
  }
  const auto nearest = nearest_border(result.holes, touch_mm);
  if (!nearest) return result;
  result.target = Guidance::Target{Guidance::Reason::hole, *nearest};
  if (!last || last->reason != Guidance::Reason::hole) return result;
  const auto kept = nearest_border(result.holes, last->place_mm);
  if ((*kept - last->place_mm).norm() < kTargetReachMm &&
      (*kept - touch_mm).norm() < kSteadiness * (*nearest - touch_mm).norm())
    result.target->place_mm = *kept;
  return result;
}

}  // namespace gelslam
