#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam {

/// How much a pixel of a contact is worth by its distance to the contact's border, 0..1; 0 outside. Near the
/// border the gel spans from object to rest and does not show the object (Huang et al., T-RO 2026, with
/// another offset: our contact ends before most of the membrane rim begins).
cv::Mat1f rim_weight(const cv::Mat1b& contact);

}  // namespace gelslam
