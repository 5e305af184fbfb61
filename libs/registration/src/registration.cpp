#include "gelslam/registration/registration.hpp"

namespace gelslam {

std::string_view describe(RegistrationStatus status) {
  switch (status) {
    case RegistrationStatus::converged:
      return "tracked";
    case RegistrationStatus::too_little_overlap:
      return "too little overlap";
    case RegistrationStatus::curvature_mismatch:
      return "the surfaces do not match";
    case RegistrationStatus::diverged:
      return "the alignment diverged";
    case RegistrationStatus::ambiguous:
      return "it fits at several places";
    case RegistrationStatus::too_little_surface:
      return "too little contact";
  }
  return "unknown";
}

std::string describe_observability(const std::array<bool, 6>& observable) {
  constexpr std::array<std::string_view, 6> motions = {"sliding along x", "sliding along y", "moving along z",
                                                       "tilting about x", "tilting about y", "twisting"};
  std::string hidden;
  int count = 0;
  for (std::size_t axis = 0; axis < motions.size(); ++axis) {
    if (observable[axis]) continue;
    hidden += (count++ == 0 ? "" : ", ") + std::string(motions[axis]);
  }
  if (count == 0) return "";
  return hidden + (count == 1 ? " is" : " are") + " not observable on this surface";
}

}  // namespace gelslam
