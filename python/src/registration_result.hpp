#pragma once

#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/registration/registration.hpp"

namespace gelslam::python {

/// Why a registration failed; of one that succeeded, which motions are not observable; else "".
std::string reason_of(const RegistrationResult& result);

}  // namespace gelslam::python
