#pragma once

#include <memory>

#include "gelslam/surface/packed_surface.hpp"

namespace gelslam {

/// A surface that a map keeps. It is held packed. Its unpacked maps are made when they are asked for and stay
/// in memory while they are used or were used recently. Copies are cheap and share the surface. Thread-safe.
class StoredSurface {
 public:
  StoredSurface() = default;          ///< none
  StoredSurface(SurfacePtr surface);  ///< holds the surface without packing it
  explicit StoredSurface(PackedSurface packed);
  /// Makes a surface that is packed when it is first asked for: tracking does not wait for that. From then on
  /// it is the same as StoredSurface(PackedSurface(*surface)).
  static StoredSurface packed_later(SurfacePtr surface);

  explicit operator bool() const { return entry_ != nullptr; }
  /// It must not be called when there is none. Hold the result while you use it: `const Surface& s =
  /// *stored.get();` would dangle.
  SurfacePtr get() const;
  SurfacePtr operator->() const { return get(); }
  PackedSurface packed() const;  ///< made if it is not packed
  SurfaceFacts facts() const;    ///< without unpacking
  bool maps_agree() const;       ///< heights, normals and contact are of one size: always so of a packed one

  /// Says whether both are the same stored surface, not an equal one.
  friend bool operator==(const StoredSurface& a, const StoredSurface& b) { return a.entry_ == b.entry_; }

 private:
  struct Entry;
  std::shared_ptr<Entry> entry_;
};

}  // namespace gelslam
