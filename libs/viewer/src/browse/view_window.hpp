#pragma once

#include <optional>
#include <vector>

#include "gelslam/viewer/view_window.hpp"
#include "ui/scene_loop.hpp"

namespace gelslam::viewer::detail {

/// State of the window, independent of how it is drawn.
class ViewControls : public SceneControls {
 public:
  /// `history` must outlive it; null if the content has no time.
  ViewControls(const RunHistory* history, bool has_second, const SceneStyle& style,
               std::optional<double> time_s);

  /// Goes to a position on the slider, 0 to 1; the right end is the run as saved.
  void seek(double share);
  /// Advances the time while playing, so that a run takes at most 20 s. Returns true while it plays.
  bool advance(double dt_s);

  bool has_time() const { return history_ != nullptr; }
  std::optional<double> time_s() const { return time_s_; }
  double share() const;
  bool plays() const { return plays_; }
  ButtonLook button(const ActionRow& row) const override;

 protected:
  void act(Action action, double now_s) override;

 private:
  void step(int keyframes);
  void play_or_pause();

  const RunHistory* history_;
  std::optional<double> time_s_;
  bool plays_ = false;
};

/// The window of `gelslam view`: a run or mesh, alone or with a second one beside it, both seen by the same
/// camera. Touch, keyframes and trajectory of a run can be shown at any time, on its final surface.
class ViewWindow : public SceneLoop {
 public:
  /// `first` must be in the frame of `second`; otherwise the distances by which it is colored have no
  /// meaning.
  ViewWindow(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);
  ~ViewWindow() override { host().make_current(); }

  ViewControls& controls() override { return controls_; }
  const Box& track() const { return track_; }  ///< The slider; empty if there is none.
  /// Draws the initial view with titles, legend and scale, without buttons.
  cv::Mat3b snapshot();

 private:
  bool advance(double now_s, double dt_s) override;
  void draw_frame(Ui& ui, double now_s) override;
  OrbitCamera whole_view(const Viewport& viewport) const override;
  const Scene& scene(std::size_t part) const override { return part > 0 ? *second_scene_ : first_scene_; }
  std::vector<Viewport> parts(const Viewport& whole) const override;

  const RunHistory* history() const { return first_.history ? &*first_.history : nullptr; }
  void show_time();
  void lay_out(const Ui& ui);
  void draw_scenes();
  void draw_titles(Ui& ui) const;
  void draw_slider(Ui& ui);

  ViewContent first_;
  std::optional<ViewContent> second_;
  Scene first_scene_;
  std::optional<Scene> second_scene_;
  std::vector<std::string> distance_notes_;
  ViewControls controls_;
  std::optional<double> shown_time_s_;
  bool camera_is_set_ = false, is_snapshot_ = false;
  Box bar_, slider_, track_;
};

}  // namespace gelslam::viewer::detail
