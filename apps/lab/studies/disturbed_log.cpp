#include "disturbed_log.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace gelslam::lab {
namespace {

/// A value of every pixel, of its place (0 to 1 along both sides).
template <class Value>
cv::Mat1f over_gel(const cv::Mat3f& picture, Value&& value) {
  cv::Mat1f map(picture.size());
  for (int v = 0; v < map.rows; ++v)
    for (int u = 0; u < map.cols; ++u)
      map(v, u) =
          static_cast<float>(value(static_cast<double>(u) / map.cols, static_cast<double>(v) / map.rows));
  return map;
}

enum Channels { all = -1, red = 2 };

void multiply(Picture& picture, const cv::Mat1f& factor, Channels which = all) {
  picture.bgr.forEach([&](cv::Vec3f& pixel, const int* at) {
    for (int c = 0; c < 3; ++c)
      if (which == all || c == which) pixel[c] *= factor(at[0], at[1]);
  });
}

void multiply(Picture& picture, double factor, Channels which = all) {
  multiply(picture, cv::Mat1f(picture.bgr.size(), static_cast<float>(factor)), which);
}

void add(Picture& picture, const cv::Mat1f& levels) {
  picture.bgr.forEach(
      [&](cv::Vec3f& pixel, const int* at) { pixel += cv::Vec3f::all(levels(at[0], at[1])); });
}

double wave(double turns) { return std::sin(2 * CV_PI * turns); }
double bell(double distance) { return std::exp(-0.5 * distance * distance); }

/// Numbers that are the same in every run: uniform from -1 to 1, or standard normal.
cv::Mat3f random_numbers(const Picture& picture, int distribution, int stream = 0) {
  cv::RNG random(static_cast<std::uint64_t>(picture.number + stream) + 1);
  cv::Mat3f numbers(picture.bgr.size());
  random.fill(numbers, distribution, distribution == cv::RNG::NORMAL ? 0.0 : -1.0, 1.0);
  return numbers;
}

void exposure_steps(Picture& p) { multiply(p, p.progress > 0.66 ? 1.2 : p.progress > 0.33 ? 0.6 : 1.0); }
void exposure_waves(Picture& p) { multiply(p, 1 + 0.3 * wave(p.time_s)); }
void red_lamp(Picture& p) { multiply(p, p.progress > 0.5 ? 0.3 : 1.0, red); }
void dim_side(Picture& p) {
  const double dimmed = 0.7 * std::min(1.0, 2 * p.progress);
  multiply(p, over_gel(p.bgr, [&](double u, double) { return 1 - dimmed * u; }), red);
}
void side_light(Picture& p) {
  const double levels = 15 * (1 - std::cos(0.5 * CV_PI * p.time_s));
  add(p, over_gel(p.bgr, [&](double u, double) { return levels * u; }));
}
void corner_light(Picture& p) {
  if (p.progress > 0.5) add(p, over_gel(p.bgr, [](double u, double v) { return 25 * u * v; }));
}
void dark_approach(Picture& p) { multiply(p, 1 - 0.3 * std::clamp(p.number / 10.0, 0.0, 1.0)); }
void darker(Picture& p) { multiply(p, 0.8); }
void overexposed(Picture& p) { multiply(p, p.progress > 0.5 ? 1.8 : 1.0); }
void flicker(Picture& p) {
  multiply(p, over_gel(p.bgr, [&](double, double v) { return 1 + 0.1 * wave(1.7 * v + 8.3 * p.time_s); }));
}
void wrong_values(Picture& p) {
  const cv::Mat3f which = random_numbers(p, cv::RNG::UNIFORM),
                  value = random_numbers(p, cv::RNG::UNIFORM, 100'000);
  p.bgr.forEach([&](cv::Vec3f& pixel, const int* at) {
    for (int c = 0; c < 3; ++c)
      if (which(at)[c] > 0.98F) pixel[c] = 127.5F * (1 + value(at)[c]);
  });
}
void noise(Picture& p) { p.bgr += 15.0 * random_numbers(p, cv::RNG::NORMAL); }
void defocus(Picture& p) { cv::GaussianBlur(p.bgr, p.bgr, {}, 1.5); }
void gamma(Picture& p) {
  p.bgr.forEach([](cv::Vec3f& pixel, const int*) {
    for (int c = 0; c < 3; ++c) pixel[c] = 255.0F * std::pow(pixel[c] / 255.0F, 0.8F);
  });
}
void lost_rows(Picture& p) {
  if (p.number % 3 == 0) p.bgr.rowRange(p.bgr.rows / 2, p.bgr.rows / 2 + 24).setTo(cv::Scalar::all(0));
}
void shadow(Picture& p) {
  const double at_u = 0.5 + 0.4 * wave(0.2 * p.time_s), at_v = 0.5 + 0.4 * wave(0.13 * p.time_s);
  multiply(p, over_gel(p.bgr, [&](double u, double v) {
             return 1 - 0.15 * bell(std::hypot(u - at_u, 0.75 * (v - at_v)) / 0.2);
           }));
}
void ring(Picture& p) {
  add(p, over_gel(p.bgr, [](double u, double v) {
        return 60 * bell((std::hypot(u - 0.6, 0.75 * (v - 0.5)) - 0.1) / 0.006);
      }));
}
void stripes(Picture& p) {
  add(p, over_gel(p.bgr, [&](double u, double v) { return 12 * wave(8 * (u + 0.3 * v) + 0.5 * p.time_s); }));
}

constexpr Disturbance kDisturbances[] = {
    {"exposure -40 %, then +20 %, at once", exposure_steps},
    {"exposure up and down by 30 % each second", exposure_waves},
    {"red lamp at 30 % from the middle on", red_lamp},
    {"red lamp dims by 70 % on one side", dim_side},
    {"30 gray levels from one side, coming and going", side_light},
    {"25 gray levels from a corner, at once", corner_light},
    {"30 % darker while the object comes near", dark_approach},
    {"20 % darker than the background", darker},
    {"overexposed by 80 % from the middle on", overexposed},
    {"rows flicker by 10 %", flicker},
    {"one value in a hundred wrong", wrong_values},
    {"noise of 15 gray levels", noise},
    {"defocus of 1.5 pixels", defocus},
    {"gamma of 0.8", gamma},
    {"24 rows lost in every third frame", lost_rows},
    {"soft shadow of 15 % wanders", shadow},
    {"bright ring of 60 gray levels appears", ring},
    {"stripes of 12 gray levels wander", stripes},
};

}  // namespace

std::span<const Disturbance> disturbances() { return kDisturbances; }

std::optional<RawFrame> DisturbedLog::next() {
  const std::optional<TactileImage> image = source_->next();
  if (!image) return std::nullopt;
  cv::Mat3b bgr = image->bgr;
  if (image->index >= background_frames_) {
    Picture picture;
    bgr.convertTo(picture.bgr, CV_32F);
    picture.number = static_cast<int>(image->index) - background_frames_;
    picture.time_s = picture.number / source_->rate_hz();
    picture.progress = picture.number / static_cast<double>(frames_);
    disturbance_.apply(picture);
    picture.bgr.convertTo(bgr, CV_8U);
  }
  RawFrame frame;
  frame.encoding = FrameEncoding::bgr;
  frame.bytes.assign(bgr.datastart, bgr.dataend);
  frame.width_px = bgr.cols;
  frame.height_px = bgr.rows;
  frame.time_s = image->time_s;
  frame.index = frame.sequence = image->index;
  return frame;
}

}  // namespace gelslam::lab
