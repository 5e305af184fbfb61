#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gelslam/viewer/scene.hpp"
#include "gelslam/viewer/view_window.hpp"

namespace gelslam::viewer::detail {

/// A run or mesh on the stage, alone or with a second one beside it, both under one camera; the first one can
/// show how far it is from the second. Touch, keyframes and trajectory of a run can be those of any time.
/// Needs the context it was made with to be current.
class ViewStage {
 public:
  /// `first` lies in the frame of `second`, or the distances mean nothing.
  ViewStage(ViewContent first, std::optional<ViewContent> second);

  const RunHistory* history() const { return first_.history ? &*first_.history : nullptr; }
  bool has_second() const { return second_.has_value(); }

  /// What was touched and known at that time, on the saved surface; or (nothing) as it was saved.
  void set_time(std::optional<double> time_s);

  /// From outside, in front of most of the surface, its long side lying; all of it in view.
  OrbitCamera first_view(const Viewport& whole) const;
  std::vector<Eigen::Vector3f> outline_mm()
      const;  ///< points all over both meshes, for OrbitCamera::fitted()
  std::optional<Eigen::Vector3f> pick(std::size_t part, const PickRay& ray) const;

  /// The parts side by side: first, then second. Only the first is colored by distance.
  std::vector<Viewport> parts(const Viewport& whole) const;
  std::string title(std::size_t part) const;
  /// What is missing or uncertain in the first, as sentences; or "".
  std::string warning() const;
  void draw(const OrbitCamera& camera, const Viewport& whole, const SceneStyle& style);
  std::optional<ColorLegend> legend(const SceneStyle& style) const;

 private:
  SceneStyle second_style(SceneStyle style) const;

  ViewContent first_;
  std::optional<ViewContent> second_;
  Scene first_scene_;
  std::optional<Scene> second_scene_;
  std::vector<std::string> distance_notes_;
};

}  // namespace gelslam::viewer::detail
