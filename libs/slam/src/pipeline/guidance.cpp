#include "gelslam/slam/guidance.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>

#include "gelslam/mesh/point_bits.hpp"

namespace gelslam {
namespace {

using Eigen::Vector3f;

constexpr double kMinHoleMm2 = 2;     ///< smaller ones are pits that the gel does not reach
constexpr double kLoopDriftMm = 0.2;  ///< two standard deviations: from here on a loop is worth the way
constexpr double kBetterKnown = 0.5;  ///< share of the present uncertainty at which a place closes a loop
constexpr float kShortCut = 0.5F;     ///< share of the way along the links that a loop may be long
constexpr float kBeyondMm = 3;        ///< from the border to the target: about half a contact, all of it new
constexpr float kTargetReachMm = 4;   ///< border that counts as the same target
constexpr double kGrowthMm2 = 3;      ///< a fraction of a contact
constexpr std::size_t kPatience = 6;  ///< looks at the arrow without that much growth
constexpr float kNearMm = 10;         ///< half the gel: further places need time
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

/// The edge's target would be one of these places again.
bool is_near(const std::vector<Vector3f>& places, const MeshBorder::Edge& edge) {
  const Vector3f target = middle(edge) + kBeyondMm * edge.outward;
  return std::any_of(places.begin(), places.end(),
                     [&](const Vector3f& place) { return (place - target).norm() < kTargetReachMm; });
}

/// From the border's middle around the edge nearest to a place, as far beyond it as a touch there reaches
/// back.
std::optional<Vector3f> nearest_border(const std::vector<MeshBorder::Loop>& loops, const Vector3f& place_mm,
                                       const std::vector<Vector3f>& given_up) {
  const MeshBorder::Edge* nearest = nullptr;
  float distance2 = std::numeric_limits<float>::infinity();
  for (const MeshBorder::Loop& loop : loops)
    for (const MeshBorder::Edge& edge : loop.edges)
      if (const float d2 = (middle(edge) - place_mm).squaredNorm();
          d2 < distance2 && !is_near(given_up, edge))
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
  return length > 0 ? Vector3f(sum / length + kBeyondMm * outward.normalized()) : middle(*nearest);
}

/// The middle of what a keyframe touches.
Vector3f place_of(const MapSnapshot::Node& node) {
  const Eigen::Vector2d center_mm =
      node.surface ? node.surface.contact_center_mm() : Eigen::Vector2d(Eigen::Vector2d::Zero());
  return (node.component_T_keyframe * Eigen::Vector3d(center_mm.x(), center_mm.y(), 0)).cast<float>();
}

/// A place of the shown piece, and the places that it is linked to.
struct KnownPlace {
  Vector3f place_mm;
  double sigma_mm = 0;
  std::vector<std::size_t> linked;
  float way_mm = std::numeric_limits<float>::infinity();  ///< along the links
};

std::vector<KnownPlace> known_places(const MapSnapshot& map) {
  std::vector<KnownPlace> places;
  std::unordered_map<int, std::size_t> index_of;
  for (const MapSnapshot::Node& node : map.nodes) {
    if (node.sigma_mm < 0) continue;
    index_of[node.keyframe] = places.size();
    places.push_back({place_of(node), node.sigma_mm, {}});
  }
  for (const MapSnapshot::Edge& edge : map.edges) {
    const auto from = index_of.find(edge.from), to = index_of.find(edge.to);
    if (edge.outlier || from == index_of.end() || to == index_of.end()) continue;
    places[from->second].linked.push_back(to->second);
    places[to->second].linked.push_back(from->second);
  }
  return places;
}

/// Finds the shortest ways from `start` (Dijkstra 1959).
void find_ways(std::vector<KnownPlace>& places, std::size_t start) {
  using Reached = std::pair<float, std::size_t>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  places[start].way_mm = 0;
  next.emplace(0.0F, start);
  while (!next.empty()) {
    const auto [way_mm, at] = next.top();
    next.pop();
    if (way_mm > places[at].way_mm) continue;
    for (const std::size_t to : places[at].linked) {
      const float longer_mm = way_mm + (places[to].place_mm - places[at].place_mm).norm();
      if (longer_mm >= places[to].way_mm) continue;
      places[to].way_mm = longer_mm;
      next.emplace(longer_mm, to);
    }
  }
}

/// The nearest place that is known much better than the one touched, and that is much nearer than along the
/// links: going there closes a loop. Where all loops are closed already there is none.
std::optional<Vector3f> nearest_known_place(const MapSnapshot& map, const Vector3f& touch_mm) {
  std::vector<KnownPlace> places = known_places(map);
  const auto distance_mm = [&](const KnownPlace& place) { return (place.place_mm - touch_mm).norm(); };
  const auto nearer = [&](const auto& a, const auto& b) { return distance_mm(a) < distance_mm(b); };
  const auto here = std::min_element(places.begin(), places.end(), nearer);
  if (here == places.end() || 2 * here->sigma_mm < kLoopDriftMm) return std::nullopt;
  find_ways(places, static_cast<std::size_t>(here - places.begin()));
  const double sigma_mm = here->sigma_mm;
  std::erase_if(places, [&](const KnownPlace& place) {
    return place.sigma_mm > kBetterKnown * sigma_mm || distance_mm(place) > kShortCut * place.way_mm;
  });
  const auto best = std::min_element(places.begin(), places.end(), nearer);
  return best == places.end() ? std::nullopt : std::optional(best->place_mm);
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

namespace {

/// What was tried and given up so far.
void remember(Guidance& guidance, const Guidance& last) {
  guidance.tried = last.tried;
  guidance.given_up = last.given_up;
  guidance.tried_area_mm2 = last.tried_area_mm2;
  const bool has_grown = guidance.area_mm2 > last.tried_area_mm2 + kGrowthMm2;
  if (!has_grown && guidance.tried.size() < kPatience) return;
  if (!has_grown) guidance.given_up.insert(guidance.given_up.end(), last.tried.begin(), last.tried.end());
  guidance.tried.clear();
  guidance.tried_area_mm2 = guidance.area_mm2;
}

std::optional<Vector3f> open_place(const Guidance& guidance, const Vector3f& touch_mm,
                                   const std::optional<Guidance::Target>& last) {
  const auto nearest = nearest_border(guidance.holes, touch_mm, guidance.given_up);
  if (!nearest || !last || last->reason != Guidance::Reason::hole) return nearest;
  const auto kept = nearest_border(guidance.holes, last->place_mm, guidance.given_up);
  const bool is_same = (*kept - last->place_mm).norm() < kTargetReachMm;
  const bool is_on_the_way = (*kept - touch_mm).norm() < kSteadiness * (*nearest - touch_mm).norm();
  return is_same && is_on_the_way ? kept : nearest;
}

}  // namespace

Guidance guide(const MeshBorder& border, const MapSnapshot& map, const Vector3f& touch_mm,
               const Guidance& last) {
  Guidance result;
  const double area_mm2 = result.area_mm2 = border.area_mm2();
  if (area_mm2 <= 0) return result;
  result.holes = border.loops(kMinHoleMm2);
  double open_mm2 = 0;
  for (const MeshBorder::Loop& loop : result.holes) open_mm2 += loop.hole_mm2;
  result.closed_share = area_mm2 / (area_mm2 + open_mm2);
  for (const MapSnapshot::Node& node : map.nodes)
    if (node.sigma_mm >= 0) result.drift_mm = std::max(result.drift_mm.value_or(0), 2 * node.sigma_mm);
  remember(result, last);
  if (const auto known = nearest_known_place(map, touch_mm)) {
    result.target = Guidance::Target{Guidance::Reason::drift, *known};
  } else if (const auto open = open_place(result, touch_mm, last.target)) {
    result.target = Guidance::Target{Guidance::Reason::hole, *open};
    if ((*open - touch_mm).norm() < kNearMm) result.tried.push_back(*open);
  }
  return result;
}

}  // namespace gelslam
