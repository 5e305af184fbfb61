#pragma once

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// How much a surface looks like itself after a shift of at least a millimetre, -1..1: the largest normalized
/// cross-correlation of its curvature (mean removed) with itself over shifts that keep half of the contact
/// shared. Near 1 for a knurl, a cloth or a straight ridge: features and curvature then agree at several
/// places, and none of them proves that it is the place. Source: own; masked correlation after Padfield, IEEE
/// TIP 2012.
double self_similarity(const Surface& surface);

}  // namespace gelslam
