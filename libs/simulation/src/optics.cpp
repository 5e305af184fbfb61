// Renders the gel as the camera sees it: Lambertian shading by three near lights plus ambient light, printed
// dots and dirt, blur of the lens, and noise. The parameters were chosen to resemble a real GelSight Mini.
// Cast shadows and light scattered from one place to another are not simulated.

#include "gelslam/simulation/optics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using simulation::detail::hash;
using simulation::detail::Random;

/// A light beside the gel. Its brightness on the untouched gel is specified directly, because a light guide
/// spreads it and the lens darkens the border. How it responds to slopes follows from its position.
struct Light {
  cv::Vec3f position_mm;  ///< in the sensor frame; z < 0: below the membrane
  float level;            ///< gray levels on the untouched gel at the brightest place
  cv::Vec2f center_mm;    ///< Center of the brightness distribution.
  cv::Vec2f width_mm;     ///< Standard deviations of the brightness distribution (Gaussian).
  float floor;            ///< Fraction of the brightness that is uniform over the gel.
  cv::Vec3f color_bgr;    ///< Includes some cross-talk between the camera's channels.
};

// Chosen to resemble a real GelSight Mini: its background, and its response to slopes in real presses of
// balls (gray levels per unit of slope at the center: red -110 in y, from the top; green +93 in x, from the
// right; blue +67 in y, from below; red and blue respond much more strongly on the side away from their
// light).
const std::array<Light, 3> kLights = {{
    {{-3.0F, -13.0F, -14.0F}, 110.0F, {-0.6F, 1.2F}, {5.6F, 3.9F}, 0.15F, {0.04F, 0.05F, 1.0F}},
    {{26.0F, 1.4F, -26.0F}, 84.0F, {-0.5F, -0.8F}, {8.0F, 5.5F}, 0.50F, {0.06F, 1.0F, 0.03F}},
    {{2.5F, 13.0F, -19.0F}, 98.0F, {-0.2F, -1.2F}, {7.5F, 4.8F}, 0.33F, {1.0F, 0.05F, 0.03F}},
}};

// BGR: light that was reflected several times inside the sensor.
const cv::Vec3f kAmbientLevel = {42.0F, 30.0F, 23.0F};
constexpr double kLensBlurPx = 0.6;
constexpr float kReadNoise = 0.7F;   // gray levels
constexpr float kShotNoise = 0.01F;  // variance per gray level

float spread(const Light& light, float x, float y) {
  const float dx = (x - light.center_mm[0]) / light.width_mm[0],
              dy = (y - light.center_mm[1]) / light.width_mm[1];
  return light.floor + (1.0F - light.floor) * std::exp(-0.5F * (dx * dx + dy * dy));
}

/// Lambert's cosine with a smooth transition to 0 at the terminator, because the lights are strips and not
/// points.
float incidence(float cosine) {
  constexpr float softness = 0.1F;
  return 0.5F * (cosine + std::sqrt(cosine * cosine + softness * softness));
}

/// Adds a spot to the map. `spot` has value, radius and position (v, u). They are passed as one initializer
/// list because its elements are evaluated in order, so that random numbers are drawn in a defined order;
/// function arguments have no such order.
void draw_spot(cv::Mat1f& map, const cv::Vec4f& spot) {
  const auto [value, radius, v, u] = std::array{spot[0], spot[1], spot[2], spot[3]};
  const int reach = static_cast<int>(std::ceil(radius * 2.5F));
  for (int y = std::max(0, static_cast<int>(v) - reach);
       y <= std::min(map.rows - 1, static_cast<int>(v) + reach); ++y)
    for (int x = std::max(0, static_cast<int>(u) - reach);
         x <= std::min(map.cols - 1, static_cast<int>(u) + reach); ++x) {
      const float r = std::hypot(static_cast<float>(x) - u, static_cast<float>(y) - v) / radius;
      map(y, x) += value * std::exp(-r * r);
    }
}

/// Returns specks on the coating as a factor on its brightness.
cv::Mat1f speckled_albedo(const cv::Size& size, Random& random) {
  cv::Mat1f albedo(size, 1.0F);
  for (int k = 0; k < 45; ++k)
    draw_spot(albedo, cv::Vec4d{random.uniform(-0.45, 0.25), random.uniform(1.0, 2.8),
                                random.uniform(0, size.height), random.uniform(0, size.width)});
  for (int k = 0; k < 6; ++k) {  // hairs and scratches
    float u = static_cast<float>(random.uniform(0, size.width)),
          v = static_cast<float>(random.uniform(0, size.height));
    double angle = random.uniform(0, 2 * std::numbers::pi);
    for (int step = 0; step < 40; ++step) {
      draw_spot(albedo, {-0.12F, 0.8F, v, u});
      angle += random.uniform(-0.2, 0.2);
      u += static_cast<float>(std::cos(angle)), v += static_cast<float>(std::sin(angle));
    }
  }
  cv::min(albedo, 1.3, albedo);
  cv::max(albedo, 0.35, albedo);
  return albedo;
}

/// Returns the slopes of small hills caused by grains between gel and object, which stay on the gel.
cv::Mat2f grain_slopes(const cv::Size& size, double pitch_mm, int grains, Random& random) {
  cv::Mat1f hills(size, 0.0F);
  for (int k = 0; k < grains; ++k)
    draw_spot(hills, cv::Vec4d{-random.uniform(0.02, 0.06), random.uniform(1.5, 3.5),
                               random.uniform(0, size.height), random.uniform(0, size.width)});
  cv::Mat1f dx, dy;
  cv::Sobel(hills, dx, CV_32F, 1, 0, 3, 0.125 / pitch_mm);
  cv::Sobel(hills, dy, CV_32F, 0, 1, 3, 0.125 / pitch_mm);
  cv::Mat2f slopes;
  cv::merge(std::vector<cv::Mat>{dx, dy}, slopes);
  return slopes;
}

/// Returns a sum of four 16-bit uniform numbers from one hash. It is close to a normal distribution (excess
/// kurtosis -0.3) with mean 0 and variance 1, and fast.
float cheap_normal(std::uint64_t bits) {
  const auto sum =
      static_cast<float>((bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  return (sum - 131070.0F) * (1.7320508F / 65536.0F);
}

}  // namespace

Optics::Optics(const SensorGeometry& geometry, const OpticsOptions& options)
    : geometry_(geometry), options_(options), gel_grid_(geometry) {
  if (!(options.noise_gain >= 0 && options.noise_gain <= 50))
    throw Error("noise gain must be between 0 and 50");
  if (options.late_grains < 0 || options.late_grains > 10'000)
    throw Error("number of grains must be between 0 and 10000");
  if (options.dot_spacing_mm != 0.0 && !(options.dot_spacing_mm >= 0.5 && options.dot_spacing_mm <= 10.0))
    throw Error("the distance of printed dots must be between 0.5 and 10 mm");
  const std::string problem =
      why_impossible(geometry.optics, geometry.width_px, geometry.height_px, geometry.pixel_pitch_mm);
  if (!problem.empty()) throw Error("the simulated sensor's optics: " + problem);
  trace_to_plane();
  rest_ = view(gel_at_rest(gel_grid_));
  const cv::Size size(geometry.width_px, geometry.height_px);
  brightness_.create(size);
  ambient_.create(size);
  for (cv::Mat3f& map : light_direction_) map.create(size);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const cv::Vec2f& place = rest_.place_px(v, u);
      const float x = gel_grid_.x_mm(static_cast<double>(place[0])),
                  y = gel_grid_.y_mm(static_cast<double>(place[1]));
      const float corner = (x * x + y * y) / 161.0F;  // 1 at the corners of a GelSight Mini's image.
      ambient_(v, u) = kAmbientLevel * (1.0F / (1.0F + 0.4F * corner));
      for (std::size_t k = 0; k < kLights.size(); ++k) {
        const cv::Vec3f to_light = kLights[k].position_mm - cv::Vec3f(x, y, 0.0F);
        const cv::Vec3f direction = to_light * static_cast<float>(1.0 / cv::norm(to_light));
        light_direction_[k](v, u) = direction;
        brightness_(v, u)[static_cast<int>(k)] =
            kLights[k].level * spread(kLights[k], x, y) / incidence(-direction[2]);
      }
    }
  Random random(hash(options.seed, 0xd127));
  if (options.dirt) {
    const cv::Size grid(gel_grid_.width_px, gel_grid_.height_px);
    albedo_ = speckled_albedo(grid, random);
    late_dirt_slope_ = grain_slopes(grid, geometry.pixel_pitch_mm, options.late_grains, random);
  }
  rest_color_ = shade(rest_.slope);
  background_ = draw(rest_);
}

cv::Mat3f Optics::shade(const cv::Mat2f& slope) const {
  cv::Mat3f picture(slope.size());
  for (int v = 0; v < slope.rows; ++v)
    for (int u = 0; u < slope.cols; ++u) {
      const float gx = slope(v, u)[0], gy = slope(v, u)[1];
      if (!rest_color_.empty() && slope(v, u) == rest_.slope(v, u)) {
        picture(v, u) = rest_color_(v, u);
        continue;
      }
      // As the camera looks from below, the normal on its side is (gx, gy, -1), normalized.
      const float scale = 1.0F / std::sqrt(1.0F + gx * gx + gy * gy);
      cv::Vec3f color = ambient_(v, u) * (0.4F + 0.6F * scale);
      for (std::size_t k = 0; k < kLights.size(); ++k) {
        const cv::Vec3f& l = light_direction_[k](v, u);
        const float cosine = scale * (gx * l[0] + gy * l[1] - l[2]);
        color += brightness_(v, u)[static_cast<int>(k)] * incidence(cosine) * kLights[k].color_bgr;
      }
      picture(v, u) = color;
    }
  return picture;
}

cv::Mat3f Optics::draw(const GelView& view) const {
  cv::Mat3f picture = shade(view.slope);
  if (!albedo_.empty()) {
    const cv::Mat1f albedo = taken(albedo_, view.place_px);
    for (int v = 0; v < picture.rows; ++v)
      for (int u = 0; u < picture.cols; ++u) picture(v, u) *= albedo(v, u);
  }
  print_dots(view, picture);
  cv::GaussianBlur(picture, picture, cv::Size(5, 5), kLensBlurPx, kLensBlurPx, cv::BORDER_REPLICATE);
  return picture;
}

/// Draws a grid of dots, aligned with the middle of the gel. The edges of a dot are one pixel wide.
void Optics::print_dots(const GelView& view, cv::Mat3f& picture) const {
  if (options_.dot_spacing_mm == 0.0) return;
  constexpr double ink_depth_mm = 0.5, ink_light = 0.3, radius_share = 1.0 / 6.0;
  const double spacing = options_.dot_spacing_mm, pitch = geometry_.pixel_pitch_mm;
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      const cv::Vec2d place = view.place_px(v, u), slope = view.slope(v, u);
      const double x = gel_grid_.x_mm(place[0]) - ink_depth_mm * slope[0],
                   y = gel_grid_.y_mm(place[1]) - ink_depth_mm * slope[1];
      const double from_dot = std::hypot(std::remainder(x, spacing), std::remainder(y, spacing));
      const double ink = std::clamp((radius_share * spacing - from_dot) / pitch + 0.5, 0.0, 1.0);
      picture(v, u) *= static_cast<float>(1.0 - (1.0 - ink_light) * ink);
    }
}

ImageCircle seen_circle(const Optics& optics, const PressedBall& ball) {
  const SensorGeometry& grid = optics.gel_grid();
  const auto seen = [&](double right_px, double down_px) {
    const double u = ball.center_px.x + right_px + 0.5 - 0.5 * grid.width_px,
                 v = ball.center_px.y + down_px + 0.5 - 0.5 * grid.height_px;
    return optics.image_px({u * grid.pixel_pitch_mm, v * grid.pixel_pitch_mm, ball.ring_height_mm});
  };
  const double radius = ball.radius_px;
  const Eigen::Vector2d right = seen(radius, 0), left = seen(-radius, 0), below = seen(0, radius),
                        above = seen(0, -radius), middle = 0.25 * (right + left + below + above);
  return {{middle.x(), middle.y()}, 0.25 * ((right - left).norm() + (below - above).norm())};
}

cv::Mat3b Optics::render(const GelShape& gel, std::int64_t frame, bool in_use) const {
  GelView seen = view(gel);
  if (in_use && !late_dirt_slope_.empty())
    cv::add(seen.slope, taken(late_dirt_slope_, seen.place_px), seen.slope);
  const cv::Mat3f picture = draw(seen);
  const auto gain = static_cast<float>(options_.noise_gain);
  const std::uint64_t key = hash(options_.seed, static_cast<std::uint64_t>(frame));
  cv::Mat3b result(picture.size());
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u)
      for (int c = 0; c < 3; ++c) {
        const float level = picture(v, u)[c];
        const auto index = static_cast<std::uint64_t>((v * picture.cols + u) * 3 + c);
        const float sigma = gain * std::sqrt(kReadNoise * kReadNoise + kShotNoise * level);
        const float noisy = level + sigma * cheap_normal(hash(key + index));
        result(v, u)[c] = cv::saturate_cast<std::uint8_t>(noisy);
      }
  return result;
}

}  // namespace gelslam
