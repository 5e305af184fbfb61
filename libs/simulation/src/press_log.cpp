#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>

#include "data_files.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using namespace simulation::detail;

constexpr int kHoldFrames = 10, kBareFrames = 6;
// Fractions of the depth in the frames of the approach; lifting uses them in reverse.
constexpr std::array<double, 2> kApproachShares = {0.3, 0.7};
// Contact radii on the gel in image widths. For a ball, the contact radius is about sqrt(depth * ball
// radius).
constexpr double kMinContact = 20.0 / 320, kMaxContact = 29.0 / 320, kMaxOfBall = 0.6;
constexpr int kFramesPerTouch = kHoldFrames + 2 * static_cast<int>(kApproachShares.size()) + kBareFrames;

void check(const PressLogSpec& spec) {
  if (!(spec.diameter_mm >= 3.0 && spec.diameter_mm <= 15.0))
    throw Error("the ball's diameter must be between 3 and 15 mm");
  if (spec.presses < 1 || spec.presses > 500) throw Error("number of presses must be between 1 and 500");
  if (spec.background_frames < 0 || spec.background_frames > 1000)
    throw Error("number of background frames must be between 0 and 1000");
}

struct PlannedTouch {
  double x_mm = 0, y_mm = 0, contact_mm = 0;
};

/// Plans a touch at a random position in a ninth of the gel; consecutive touches go through the ninths.
PlannedTouch plan_touch(const PressLogSpec& spec, int number, Random& random) {
  const double width_mm = 2.0 * spec.geometry.half_width_mm(), radius = 0.5 * spec.diameter_mm;
  PlannedTouch touch;
  // The center of a ball in the outermost part of the gel is hardly visible.
  const auto place = [&](int third, double half_mm) {
    constexpr double outermost = 0.85;
    const double low = std::max(third * 2.0 / 3.0 - 1.0, -outermost),
                 high = std::min((third + 1) * 2.0 / 3.0 - 1.0, outermost);
    return random.uniform(low, high) * half_mm;
  };
  touch.x_mm = place(number % 3, spec.geometry.half_width_mm());
  touch.y_mm = place(number / 3 % 3, spec.geometry.half_height_mm());
  touch.contact_mm = std::min(random.uniform(kMinContact, kMaxContact) * width_mm, kMaxOfBall * radius);
  return touch;
}

/// Renders the log and counts its frames.
class PressFilm {
 public:
  PressFilm(const PressLogSpec& spec, const std::function<void(const cv::Mat3b&)>& take)
      : spec_(spec),
        take_(take),
        optics_(spec.geometry, spec.optics),
        rest_(gel_at_rest(optics_.gel_grid())) {}

  void show(const GelShape& gel, int frames) {
    for (int k = 0; k < frames; ++k, ++frame_) take_(optics_.render(gel, frame_, false));
  }
  void show_bare(int frames) { show(rest_, frames); }

  SimulatedTouch show_touch(const PlannedTouch& planned) {
    for (const double share : kApproachShares) show(pressed(planned, share).gel, 1);
    const PressedBall ball = pressed(planned, 1.0);
    const ImageCircle circle = seen_circle(optics_, ball);
    const SimulatedTouch touch{frame_, frame_ + kHoldFrames - 1, circle.center_px, circle.radius_px};
    show(ball.gel, kHoldFrames);
    for (auto share = kApproachShares.rbegin(); share != kApproachShares.rend(); ++share)
      show(pressed(planned, *share).gel, 1);
    show_bare(kBareFrames);
    return touch;
  }

 private:
  PressedBall pressed(const PlannedTouch& touch, double share) const {
    const double radius = 0.5 * spec_.diameter_mm,
                 depth = share * touch.contact_mm * touch.contact_mm / radius;
    return press_ball(optics_.gel_grid(), radius, touch.x_mm, touch.y_mm,
                      depth - spec_.geometry.rest_mm(touch.x_mm, touch.y_mm));
  }

  const PressLogSpec& spec_;
  const std::function<void(const cv::Mat3b&)>& take_;
  Optics optics_;
  GelShape rest_;
  int frame_ = 0;
};

}  // namespace

std::vector<SimulatedTouch> simulate_press_log(const PressLogSpec& spec,
                                               const std::function<void(const cv::Mat3b& bgr)>& take) {
  check(spec);
  PressFilm film(spec, take);
  film.show_bare(spec.background_frames);
  std::vector<SimulatedTouch> touches;
  touches.reserve(static_cast<std::size_t>(spec.presses));
  Random random(hash(spec.seed, 0x9e55));
  for (int number = 0; number < spec.presses; ++number)
    touches.push_back(film.show_touch(plan_touch(spec, number, random)));
  return touches;
}

void write_press_log(const std::filesystem::path& folder, const PressLogSpec& spec, ProgressSink& progress) {
  check(spec);
  std::filesystem::create_directories(folder);
  AviWriter video(folder / "gelsight.avi", spec.geometry.width_px, spec.geometry.height_px,
                  spec.frame_rate_hz);
  progress.begin("pressing a ball", spec.background_frames + spec.presses * kFramesPerTouch);
  std::int64_t frames = 0;
  const std::vector<SimulatedTouch> touches = simulate_press_log(spec, [&](const cv::Mat3b& bgr) {
    video.add(encode_jpeg(bgr));
    progress.update(++frames);
  });
  progress.end();
  std::string truth = "first_frame,last_frame,diameter_mm,center_u_px,center_v_px,radius_px\n";
  for (const SimulatedTouch& touch : touches)
    truth += fmt::format("{},{},{:g},{:g},{:g},{:g}\n", touch.first_frame, touch.last_frame, spec.diameter_mm,
                         touch.center_px.x, touch.center_px.y, touch.radius_px);
  write_file_atomically(folder / "touches.csv", truth);
  write_optics(folder / kOpticsFileName, spec.geometry.optics);
  write_file_atomically(folder / "config.yaml", config_yaml(folder, spec.geometry, spec.frame_rate_hz, {}));
  video.finish();  // last: a folder with a gelsight.avi is whole
}

}  // namespace gelslam
