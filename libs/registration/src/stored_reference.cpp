#include <mutex>
#include <utility>

#include "gelslam/core/recently_used.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {
namespace {

/// 0.5 MB each, and the surface (1.7 MB).
RecentlyUsed<std::shared_ptr<const NormalFlowReference>>& ready_references() {
  static RecentlyUsed<std::shared_ptr<const NormalFlowReference>> references;
  return references;
}

}  // namespace

struct StoredReference::Entry {
  std::mutex mutex;
  std::shared_ptr<const NormalFlowReference> ready;  ///< kept as it is; else what follows counts
  StoredSurface surface;
  NormalFlowOptions options;
  std::weak_ptr<const NormalFlowReference> made;
  SelfSimilarityPtr self_similarity = make_self_similarity();  ///< survives the reference: it is costly
};

StoredReference::StoredReference(std::shared_ptr<const NormalFlowReference> ready) {
  if (!ready) return;
  entry_ = std::make_shared<Entry>();
  entry_->ready = std::move(ready);
}

StoredReference::StoredReference(StoredSurface surface, const NormalFlowOptions& options)
    : entry_(std::make_shared<Entry>()) {
  entry_->surface = std::move(surface);
  entry_->options = options;
}

std::shared_ptr<const NormalFlowReference> StoredReference::get() const {
  std::shared_ptr<const NormalFlowReference> reference;
  {
    const std::lock_guard lock(entry_->mutex);
    if (entry_->ready) return entry_->ready;
    reference = entry_->made.lock();
    if (!reference)
      entry_->made = reference = std::make_shared<const NormalFlowReference>(
          entry_->surface.get(), entry_->options, entry_->self_similarity);
  }
  ready_references().use(reference);
  return reference;
}

}  // namespace gelslam
