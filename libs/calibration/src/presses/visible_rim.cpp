#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "presses/press_fit.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr int kSectors = 36, kRaysPerSector = 5;
constexpr double kRayStepPx = 0.5;
constexpr double kInnerShare = 0.75, kOuterShare = 1.5;  // of the knee: where the edge is looked for
constexpr double kDirectionFromShare = 0.8,
                 kDirectionToShare = 1.0;  // where the color's direction is read
constexpr std::size_t kMinPlaces = 14;
constexpr double kMaxCenterShiftPx = 4.0, kMaxGrowthPx = 7.0;
constexpr double kRobustPx = 1.0;
constexpr double kPeopleDrawWiderPx = -0.4;  // than the steepest fall, in hand-made labels of real presses
constexpr int kRimPasses = 2;

std::optional<cv::Vec3f> color_at(const cv::Mat3f& image, double u, double v) {
  const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
  if (left < 0 || top < 0 || left + 1 >= image.cols || top + 1 >= image.rows) return std::nullopt;
  const auto x = static_cast<float>(u - left), y = static_cast<float>(v - top);
  return (image(top, left) * (1.0F - x) + image(top, left + 1) * x) * (1.0F - y) +
         (image(top + 1, left) * (1.0F - x) + image(top + 1, left + 1) * x) * y;
}

/// Mean color change of one sector at growing distances; empty when it leaves the picture.
std::vector<cv::Vec3f> sector_profile(const cv::Mat3f& image, const ContactCircle& circle, double angle) {
  std::vector<cv::Vec3f> profile;
  for (double r = 0.5 * circle.radius_px; r < 1.7 * circle.radius_px; r += kRayStepPx) {
    cv::Vec3f sum(0, 0, 0);
    for (int ray = 0; ray < kRaysPerSector; ++ray) {
      const double offset =
          (static_cast<double>(ray) / (kRaysPerSector - 1) - 0.5) * 2.0 * std::numbers::pi / kSectors;
      const auto color = color_at(image, circle.u_px + r * std::cos(angle + offset),
                                  circle.v_px + r * std::sin(angle + offset));
      if (!color) return {};
      sum += *color * (1.0F / kRaysPerSector);
    }
    profile.push_back(sum);
  }
  return profile;
}

/// Distance at which the change, measured along its own direction near the rim, falls most steeply.
std::optional<double> steepest_fall(const std::vector<cv::Vec3f>& profile, double radius_px) {
  const double start = 0.5 * radius_px;
  const auto index = [&](double share) {
    return static_cast<std::size_t>((share * radius_px - start) / kRayStepPx);
  };
  cv::Vec3f direction(0, 0, 0);
  for (std::size_t k = index(kDirectionFromShare); k < index(kDirectionToShare); ++k) direction += profile[k];
  const double length = cv::norm(direction);
  if (length < 1e-6) return std::nullopt;
  double steepest = 0.0;
  std::optional<double> place;
  constexpr std::size_t half = 3;  // slope over 3 pixels, so that noise does not decide
  for (std::size_t k = index(kInnerShare); k + half < profile.size() && k < index(kOuterShare); ++k) {
    const double fall = static_cast<double>((profile[k - half] - profile[k + half]).dot(direction)) / length;
    if (fall <= steepest) continue;
    steepest = fall;
    place = start + kRayStepPx * static_cast<double>(k);
  }
  return place;
}

struct DistanceFromCircle {
  Eigen::Vector2d place;
  template <class T>
  bool operator()(const T* circle, T* distance) const {
    using std::hypot;
    *distance = hypot(place.x() - circle[0], place.y() - circle[1]) - circle[2];
    return true;
  }
};

ContactCircle circle_through(const std::vector<Eigen::Vector2d>& places, const ContactCircle& start) {
  std::array<double, 3> circle = {start.u_px, start.v_px, start.radius_px};
  ceres::Problem problem;
  for (const Eigen::Vector2d& place : places)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DistanceFromCircle, 1, 3>(new DistanceFromCircle{place}),
        new ceres::SoftLOneLoss(kRobustPx), circle.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return {circle[0], circle[1], circle[2]};
}

}  // namespace

std::optional<ContactCircle> find_visible_rim(const cv::Mat3f& relative_change, const ContactCircle& knee) {
  ContactCircle circle = knee, rays_from = knee;
  for (int pass = 0; pass < kRimPasses; ++pass) {
    std::vector<Eigen::Vector2d> places;
    for (int sector = 0; sector < kSectors; ++sector) {
      const double angle = 2.0 * std::numbers::pi * sector / kSectors;
      const auto profile = sector_profile(relative_change, rays_from, angle);
      if (profile.empty()) continue;
      if (const auto distance = steepest_fall(profile, rays_from.radius_px))
        places.emplace_back(rays_from.u_px + *distance * std::cos(angle),
                            rays_from.v_px + *distance * std::sin(angle));
    }
    if (places.size() < kMinPlaces) return std::nullopt;
    circle = circle_through(places, circle);
    rays_from = {circle.u_px, circle.v_px, knee.radius_px};
  }
  circle.radius_px += kPeopleDrawWiderPx;
  const double growth = circle.radius_px - knee.radius_px;
  const bool near_knee = std::hypot(circle.u_px - knee.u_px, circle.v_px - knee.v_px) <= kMaxCenterShiftPx &&
                         growth >= 0.0 && growth <= kMaxGrowthPx;
  return near_knee ? std::optional(circle) : std::nullopt;
}

}  // namespace gelslam::calibration::detail
