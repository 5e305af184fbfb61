#include "summary_words.hpp"

#include "gelslam/core/text.hpp"

namespace gelslam {

std::string map_words(const ReconstructSummary& s) {
  return counted(s.in_map, "frame") + " in the map; " + counted(s.trials, "trial") + " in " +
         counted(s.components, "piece") + ", " + counted(s.keyframes, "keyframe") + ", " +
         counted(s.loops, "loop");
}

std::string mesh_words(const ReconstructSummary& s) {
  return "mesh of " + std::to_string(s.vertices) + " vertices and " + counted(s.triangles, "triangle");
}

}  // namespace gelslam
