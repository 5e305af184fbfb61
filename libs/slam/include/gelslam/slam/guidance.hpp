#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

/// A mesh in blocks, at one time. Immutable, and cheap to copy.
using MeshBlocks = std::map<std::int64_t, std::shared_ptr<const Mesh>>;

/// The open border of a growing mesh: where the surface ends.
class MeshBorder {
 public:
  struct Edge {
    Eigen::Vector3f from_mm,
        to_mm;                ///< in the triangle's order: the surface lies to the left, seen from outside
    Eigen::Vector3f outward;  ///< unit, in the surface, away from it
  };
  /// One closed chain of edges.
  struct Loop {
    std::vector<Edge> edges;
    double hole_mm2 = 0;  ///< area of a fan from its middle that would close it
  };

  /// Sets the mesh; only blocks that have changed since the last call cost time.
  void update(const MeshBlocks& blocks);
  double area_mm2() const;  ///< of the surface
  /// Chains that leave open at least `min_hole_mm2`, the largest first.
  std::vector<Loop> loops(double min_hole_mm2) const;

 private:
  struct Block {
    std::shared_ptr<const Mesh> mesh;
    std::vector<Edge> edges;  ///< that one triangle of the block has
    double area_mm2 = 0;
  };
  static Block border_of(const std::shared_ptr<const Mesh>& mesh);

  std::map<std::int64_t, Block> blocks_;
};

/// What a person should do next, concluded from the surface's open border and from how well the pose graph
/// knows its places. Map frame, mm.
struct Guidance {
  enum class Reason {
    hole,   ///< the surface is open there
    drift,  ///< that place is known better than what is touched now: touching it closes a loop
  };
  struct Target {
    Reason reason = Reason::hole;
    Eigen::Vector3f place_mm = Eigen::Vector3f::Zero();
  };
  double area_mm2 = 0;                  ///< of the surface
  double closed_share = 0;              ///< surface over surface and holes, [0, 1]
  std::optional<double> drift_mm;       ///< two standard deviations of the place known worst
  std::vector<MeshBorder::Loop> holes;  ///< the largest first
  std::optional<Target> target;         ///< none: the surface is complete, or there is none yet
  std::vector<Eigen::Vector3f> tried;   ///< where the arrow led, nearby, since the surface last grew
  double tried_area_mm2 = 0;            ///< of the surface then
  /// Open, but the surface did not grow there: the object ends, or is too hollow for the gel.
  std::vector<Eigen::Vector3f> given_up;
  bool is_enough() const { return closed_share > 0 && holes.empty(); }
};

/// Chooses where to go from `touch_mm`, the middle of what is touched (or was last). A target that is still
/// open is kept while the way to it is not twice as long as to another one, so that the arrow is steady, and
/// given up where the surface does not grow although the touch is near. `last`: the previous result.
Guidance guide(const MeshBorder& border, const MapSnapshot& map, const Eigen::Vector3f& touch_mm,
               const Guidance& last);

}  // namespace gelslam
