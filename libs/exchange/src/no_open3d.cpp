#include "gelslam/core/error.hpp"
#include "gelslam/exchange/watertight.hpp"

namespace gelslam {

/// Used instead of watertight.cpp in builds without Open3D.
WatertightMesh make_watertight(const Mesh&, bool, ProgressSink&) {
  throw Error("watertight meshes need Open3D, and this program was built without it");
}

}  // namespace gelslam
