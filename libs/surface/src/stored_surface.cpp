#include "gelslam/surface/stored_surface.hpp"

#include <mutex>
#include <utility>

#include "gelslam/core/recently_used.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {
namespace {

/// 1.7 MB each at 320x240. Loop closure and refinement come back to the same few dozen keyframes.
RecentlyUsed<SurfacePtr>& unpacked_surfaces() {
  static RecentlyUsed<SurfacePtr> surfaces;
  return surfaces;
}

}  // namespace

struct StoredSurface::Entry {
  std::mutex mutex;
  SurfacePtr as_it_is;  ///< never packed, or not yet
  bool to_be_packed = false;
  std::shared_ptr<const PackedSurface> packed;
  std::weak_ptr<const Surface> unpacked;

  /// Under the mutex.
  void pack() {
    if (!packed) packed = std::make_shared<const PackedSurface>(*as_it_is);
    if (std::exchange(to_be_packed, false)) as_it_is.reset();
  }
};

StoredSurface::StoredSurface(SurfacePtr surface) {
  if (!surface) return;
  entry_ = std::make_shared<Entry>();
  entry_->as_it_is = std::move(surface);
}

StoredSurface::StoredSurface(PackedSurface packed) : entry_(std::make_shared<Entry>()) {
  entry_->packed = std::make_shared<const PackedSurface>(std::move(packed));
}

StoredSurface StoredSurface::packed_later(SurfacePtr surface) {
  StoredSurface stored(std::move(surface));
  if (stored) stored.entry_->to_be_packed = true;
  return stored;
}

SurfacePtr StoredSurface::get() const {
  SurfacePtr surface;
  {
    const std::lock_guard lock(entry_->mutex);
    if (entry_->as_it_is && !entry_->to_be_packed) return entry_->as_it_is;
    surface = entry_->unpacked.lock();
    if (!surface) {
      entry_->pack();
      entry_->unpacked = surface = entry_->packed->unpack();
    }
  }
  unpacked_surfaces().use(surface);
  return surface;
}

std::shared_ptr<const PackedSurface> StoredSurface::packed() const {
  const std::lock_guard lock(entry_->mutex);
  entry_->pack();
  return entry_->packed;
}

int StoredSurface::contact_pixels() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? entry_->as_it_is->contact_pixels : entry_->packed->contact_pixels();
}

Eigen::Vector2d StoredSurface::contact_center_mm() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? gelslam::contact_center_mm(*entry_->as_it_is)
                          : entry_->packed->contact_center_mm();
}

cv::Size StoredSurface::size() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? entry_->as_it_is->contact.size() : entry_->packed->size();
}

double StoredSurface::pixel_pitch_mm() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? entry_->as_it_is->pixel_pitch_mm : entry_->packed->pixel_pitch_mm();
}

double StoredSurface::model_sigma() const {
  const std::lock_guard lock(entry_->mutex);
  return entry_->as_it_is ? entry_->as_it_is->model_sigma : entry_->packed->model_sigma();
}

bool StoredSurface::maps_agree() const {
  const std::lock_guard lock(entry_->mutex);
  const Surface* surface = entry_->as_it_is.get();
  return !surface || (surface->height_mm.size() == surface->contact.size() &&
                      surface->normals.size() == surface->contact.size());
}

}  // namespace gelslam
