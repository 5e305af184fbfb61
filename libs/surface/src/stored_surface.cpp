#include "gelslam/surface/stored_surface.hpp"

#include <mutex>
#include <optional>
#include <utility>

#include "gelslam/core/lru_cached.hpp"

namespace gelslam {

struct StoredSurface::Entry {
  std::mutex mutex;
  SurfacePtr as_it_is;        ///< the surface as it was given; null once it has been packed
  bool to_be_packed = false;  ///< `as_it_is` is released as soon as the packed surface exists
  std::optional<PackedSurface> packed;
  /// The unpacked surface, 1.7 MB at 320x240. A few dozen of them stay in memory, because loop closure and
  /// refinement use the same keyframes again and again.
  LruCached<Surface> unpacked;
};

StoredSurface::StoredSurface(SurfacePtr surface) {
  if (!surface) return;
  entry_ = std::make_shared<Entry>();
  entry_->as_it_is = std::move(surface);
}

StoredSurface::StoredSurface(PackedSurface packed) : entry_(std::make_shared<Entry>()) {
  entry_->packed = std::move(packed);
}

StoredSurface StoredSurface::packed_later(SurfacePtr surface) {
  StoredSurface stored(std::move(surface));
  if (stored) stored.entry_->to_be_packed = true;
  return stored;
}

SurfacePtr StoredSurface::get() const {
  {
    const std::lock_guard lock(entry_->mutex);
    if (entry_->as_it_is && !entry_->to_be_packed) return entry_->as_it_is;
  }
  return entry_->unpacked.get([this] { return packed().unpack(); });
}

PackedSurface StoredSurface::packed() const {
  const std::lock_guard lock(entry_->mutex);
  if (!entry_->packed) entry_->packed.emplace(*entry_->as_it_is);
  if (std::exchange(entry_->to_be_packed, false)) entry_->as_it_is.reset();
  return *entry_->packed;
}

SurfaceFacts StoredSurface::facts() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? facts_of(*entry_->as_it_is) : entry_->packed->facts();
}

bool StoredSurface::maps_agree() const {
  const std::lock_guard lock(entry_->mutex);
  const Surface* surface = entry_->as_it_is.get();
  return !surface || (surface->height_mm.size() == surface->contact.size() &&
                      surface->normals.size() == surface->contact.size());
}

}  // namespace gelslam
