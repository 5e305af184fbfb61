#include "gelslam/core/error.hpp"
#include "gelslam/exchange/watertight.hpp"

namespace gelslam {

/// In place of watertight.cpp where Open3D is missing.
WatertightMesh make_watertight(const Mesh&, bool, ProgressSink&) {
  throw Error("watertight meshes need Open3D, and this program was built without it");
}

}  // namespace gelslam
