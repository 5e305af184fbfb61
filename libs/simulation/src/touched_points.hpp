#pragma once

#include <vector>

#include "gelslam/simulation/simulator.hpp"

namespace gelslam::simulation::detail {

/// Collects which vertices of the object's surface the gel really touched. Not thread-safe.
class TouchedPoints {
 public:
  explicit TouchedPoints(const Simulator& simulator)
      : simulator_(simulator), touched_(simulator.surface().vertices_mm.size(), false) {}
  void add(const SimulatedFrame& frame);
  /// x y z after one another, object frame, metres; in the order of the vertices.
  std::vector<float> points_m() const;

 private:
  const Simulator& simulator_;
  std::vector<bool> touched_;
};

}  // namespace gelslam::simulation::detail
