#pragma once

#include <vector>

#include "gelslam/viewer/map_window.hpp"
#include "live/live_window.hpp"

namespace gelslam::viewer::detail {

/// Returns the state of localization in words for a frame; null if there is no frame yet.
StateWords place_words(const FrameReport* touch);

/// The window of a sensor that is localized in a known map.
class MapWindow : public SceneLoop {
 public:
  /// `map` and `touches` must outlive it.
  MapWindow(const ShownMap& map, const LocatedTouches& touches, const WindowOptions& options);
  ~MapWindow() override { host().make_current(); }

  SceneControls& controls() override { return controls_; }
  void turn_to_touch() { follow_touch(1e9); }  ///< Without animation.

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(Ui& ui, double now_s) override;
  OrbitCamera whole_view(const Viewport& viewport) const override;
  const Scene& scene(std::size_t /*part*/) const override { return scene_; }

  void show(const std::shared_ptr<const FrameReport>& touch);
  bool follow_touch(double dt_s);
  void draw_probabilities(Ui& ui) const;
  void draw_side(Ui& ui, const Box& side) const;
  const std::vector<PlaceHypothesis>& places() const;

  const ShownMap& map_;
  const LocatedTouches& touches_;
  SceneControls controls_;
  Scene scene_;
  std::shared_ptr<const FrameReport> touch_;  ///< The touch that is shown.
  LiveFrame frame_;                           ///< Texts and images of the touch.
  bool camera_is_set_ = false;
};

}  // namespace gelslam::viewer::detail
