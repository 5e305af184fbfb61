#pragma once

#include "gelslam/mesh/mesh.hpp"

namespace gelslam::lab {

/// A plate of 30 x 24 x 4 mm whose bumps look the same after half a turn about z: a brick's face.
Mesh half_turn_plate();

/// A hexagonal rod of 18 mm across flats, 46 mm long, with the same bumps on all six faces: a nut.
Mesh six_fold_rod();

}  // namespace gelslam::lab
