#pragma once

#include <memory>

#include "gelslam/surface/packed_surface.hpp"

namespace gelslam {

/// A surface that a map keeps in packed form. Its maps are unpacked when they are requested, and stay in
/// memory while they are used or were used recently. Copies are cheap and share the surface. Thread-safe.
class StoredSurface {
 public:
  StoredSurface() = default;          ///< holds no surface
  StoredSurface(SurfacePtr surface);  ///< holds the surface without packing it
  explicit StoredSurface(PackedSurface packed);
  /// Returns a stored surface that is packed when packed() or get() is first called, so that tracking does
  /// not have to wait for it. From then on it is the same as StoredSurface(PackedSurface(*surface)).
  static StoredSurface packed_later(SurfacePtr surface);

  explicit operator bool() const { return entry_ != nullptr; }
  /// Returns the surface with its maps. There must be one. Keep the result as long as you use it: a reference
  /// like `const Surface& s = *stored.get();` would dangle.
  SurfacePtr get() const;
  SurfacePtr operator->() const { return get(); }
  PackedSurface packed() const;  ///< packs the surface if necessary
  SurfaceFacts facts() const;    ///< does not unpack the surface
  bool maps_agree() const;       ///< whether height, normals and contact have one size, as packed ones have

  /// Returns whether both share the same stored surface. Equal copies of a surface are different.
  friend bool operator==(const StoredSurface& a, const StoredSurface& b) { return a.entry_ == b.entry_; }

 private:
  struct Entry;
  std::shared_ptr<Entry> entry_;
};

}  // namespace gelslam
