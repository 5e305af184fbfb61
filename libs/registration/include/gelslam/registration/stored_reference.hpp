#pragma once

#include <memory>

#include "gelslam/registration/normal_flow.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// What registration needs of a surface that is kept for long: made when it is asked for, and kept for as
/// long as somebody uses it or it was used a short while ago. Cheap to copy. Thread-safe.
class StoredReference {
 public:
  StoredReference() = default;                                        ///< none
  StoredReference(std::shared_ptr<const NormalFlowReference> ready);  ///< kept as it is
  StoredReference(StoredSurface surface, const NormalFlowOptions& options);

  explicit operator bool() const { return entry_ != nullptr; }
  /// Not of none. Hold the result while you use it.
  std::shared_ptr<const NormalFlowReference> get() const;
  std::shared_ptr<const NormalFlowReference> operator->() const { return get(); }

 private:
  struct Entry;
  std::shared_ptr<Entry> entry_;
};

}  // namespace gelslam
