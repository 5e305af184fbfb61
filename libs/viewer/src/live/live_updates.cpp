#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "live/live_window.hpp"

namespace gelslam::viewer::detail {
namespace {

const cv::Scalar kOutline(theme::kGreen >> 16U & 0xFFU, theme::kGreen >> 8U & 0xFFU, theme::kGreen & 0xFFU);

cv::Size scaled_size(const cv::Size& from) {
  const double height = static_cast<double>(from.height) * kPictureWidthPx / from.width;
  return {kPictureWidthPx, std::max(1, cvRound(height))};
}

/// Returns the enlarged mask, smoothed again so that its border is drawn without steps.
cv::Mat1b enlarged(const cv::Mat1b& mask, const cv::Size& size) {
  cv::Mat1b large;
  cv::resize(mask, large, size, 0, 0, cv::INTER_CUBIC);
  cv::GaussianBlur(large, large, {5, 5}, 0);
  cv::threshold(large, large, 127, 255, cv::THRESH_BINARY);
  return large;
}

}  // namespace

bool LiveWindow::poll_updates() {
  bool news = false;
  if (const auto mesh = session_.mesh()) {
    const MeshFeed::Changes changes = mesh->since(mesh_version_, SIZE_MAX);
    mesh_version_ = changes.version;
    scene_.update(changes);
    news = changes.cleared || !changes.blocks.empty();
  }
  if (const auto touch = session_.touch(); touch != touch_) {
    take_touch(touch);
    news = true;
  }
  const auto map = session_.map();
  if (map != map_) {
    map_ = map;
    scene_.set_map(*map_);
    trajectory_is_old_ = true;
    news = true;
  }
  if (!news) return false;
  touch_place_ = touch_ && touch_->tracked.keyframe ? map_->pose_of(samples_.back()) : std::nullopt;
  if (touch_ && !touch_place_) touch_place_ = touch_->in_map;  // The mapper may be busy for some time.
  // Surface that is not joined to the map yet is shown beside it.
  if (unjoined_preview_.follow(*map_, touch_.get(), touch_place_))
    scene_.set_unjoined(unjoined_preview_.mesh());
  if (unjoined_preview_.is_apart() && !unjoined_preview_.is_shown())
    unjoined_preview_.place_beside(scene_.bounds_mm(), camera_);
  scene_.place_unjoined(unjoined_preview_.map_T_unjoined());
  place_touch();
  return true;
}

void LiveWindow::take_touch(const std::shared_ptr<const FrameReport>& touch) {
  touch_ = touch;
  if (!touch) return;
  if (touch->tracked.keyframe) samples_.push_back(record_of(touch->tracked));
  frame_.tactile.set(tactile_picture(touch->image, touch->surface.get()));
  if (touch->surface) frame_.normals.set(normal_picture(*touch->surface));
}

void LiveWindow::place_touch() {
  map_T_touch_.reset();
  TouchPatch patch;
  if (touch_place_ && touch_->surface) {
    map_T_touch_ = unjoined_preview_.map_T_touch();
    if (touch_place_->component == map_->shown_component) map_T_touch_ = touch_place_->map_T_frame.pose;
    if (map_T_touch_) patch = {touch_->surface, map_->gradient_scale.mean(), {{*map_T_touch_}}};
  }
  scene_.set_touch(std::move(patch));
}

void LiveWindow::rebuild_trajectory() {
  std::vector<std::vector<Pose>> segments;
  int trial = -1;
  for (const FrameRecord& sample : samples_) {
    const auto place = map_->pose_of(sample);
    if (!place || place->component != map_->shown_component) continue;
    if (segments.empty() || sample.trial != trial) segments.emplace_back();
    trial = sample.trial;
    segments.back().push_back(place->map_T_frame.pose);
  }
  scene_.set_trajectory(segments);
  trajectory_is_old_ = false;
}

cv::Mat3b tactile_picture(const cv::Mat3b& image, const Surface* surface) {
  if (image.empty()) return {};
  const cv::Size size = scaled_size(image.size());
  cv::Mat3b picture;
  cv::resize(image, picture, size, 0, 0, size.width < image.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  if (!surface || surface->contact.empty()) return picture;
  std::vector<std::vector<cv::Point>> borders;
  cv::findContours(enlarged(surface->contact, size), borders, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  const int thickness = std::max(1, size.width / 120);
  cv::polylines(picture, borders, true, cv::Scalar(20, 20, 20), thickness + 2, cv::LINE_AA);
  cv::polylines(picture, borders, true, kOutline, thickness, cv::LINE_AA);
  return picture;
}

cv::Mat3b normal_picture(const Surface& surface) {
  if (surface.normals.empty()) return {};
  cv::Mat3b colors(surface.normals.size());
  for (int v = 0; v < colors.rows; ++v)
    for (int u = 0; u < colors.cols; ++u) {
      const cv::Vec3f n = surface.normals(v, u);
      const bool touched = surface.contact(v, u) != 0;
      cv::Vec3b& color = colors(v, u);
      for (int channel = 0; channel < 3; ++channel) {
        const float full = 127.5F * (1.0F + n[2 - channel]);  // BGR stores the normal as z, y, x.
        color[channel] = cv::saturate_cast<uchar>(touched ? full : 0.25F * full + 45.0F);
      }
    }
  cv::Mat3b picture;
  const cv::Size size = scaled_size(colors.size());
  cv::resize(colors, picture, size, 0, 0, size.width < colors.cols ? cv::INTER_AREA : cv::INTER_LINEAR);
  return picture;
}

}  // namespace gelslam::viewer::detail
