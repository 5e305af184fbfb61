#include "gelslam/registration/registration.hpp"

namespace gelslam {

std::string_view describe(RegistrationStatus status) {
  switch (status) {
    case RegistrationStatus::converged: return "tracked";
    case RegistrationStatus::too_little_overlap: return "too little overlap";
    case RegistrationStatus::curvature_mismatch: return "the surfaces do not match";
    case RegistrationStatus::diverged: return "the alignment diverged";
    case RegistrationStatus::too_little_surface: return "too little contact";
  }
  return "unknown";
}

}  // namespace gelslam
