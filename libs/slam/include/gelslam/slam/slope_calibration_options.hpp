#pragma once

#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// How the model of slopes is corrected when a scan has ended.
struct SlopeCalibrationOptions {
  bool enabled = true;
  int rounds = 3;
  NormalFlowOptions registration;
  /// In place of registration's: what is left of a gradient scale once slopes were corrected.
  double remaining_gain_error = 0.02;
};

}  // namespace gelslam
