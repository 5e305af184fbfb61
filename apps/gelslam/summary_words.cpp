#include "summary_words.hpp"

namespace gelslam {

std::string counted(std::int64_t number, const std::string& noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

std::string map_words(const ReconstructSummary& s) {
  return counted(s.in_map, "frame") + " in the map; " + counted(s.trials, "trial") + " in " +
         counted(s.groups, "group") + ", " + counted(s.keyframes, "keyframe") + ", " +
         counted(s.loops, "loop");
}

std::string mesh_words(const ReconstructSummary& s) {
  return "mesh of " + std::to_string(s.vertices) + " vertices and " + std::to_string(s.triangles) +
         " triangles";
}

}  // namespace gelslam
