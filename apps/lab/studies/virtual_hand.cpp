#include "virtual_hand.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "gelslam/core/parallel.hpp"

namespace gelslam::lab {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDepthMm = 0.5;
constexpr int kPressInFrames = 8;
constexpr double kMarginMm = 3;     ///< of a rod or a flat object at its ends
constexpr double kCentering = 0.3;  ///< share of the contact's offset that is made good per frame
// Unsteadiness: standard deviations, and how long it lasts.
constexpr double kHeadingRad = 0.25, kTwistRad = 0.09, kDepthShare = 0.15, kSteadyS = 1;

/// Middle of the contact on the gel; nothing without contact.
std::optional<Vector2d> contact_middle(const GelShape& gel, const SensorGeometry& geometry) {
  const cv::Moments m = cv::moments(gel.contact, true);
  if (m.m00 < 1) return std::nullopt;
  return Vector2d(geometry.x_mm(m.m10 / m.m00), geometry.y_mm(m.m01 / m.m00));
}

struct Position {
  Vector3d direction;
  Vector2d place_mm;
};

/// Every way in which the hand can hold the object, in steps of less than a contact.
std::vector<Position> positions(const Shape& shape, const Vector2d& reach_mm) {
  constexpr int kDirections = 300, kRolls = 24;
  constexpr double kStepMm = 3;
  std::vector<Position> all;
  if (shape.kind() == ShapeKind::body) {
    for (int i = 0; i < kDirections; ++i) {  // a spiral from pole to pole
      const double z = 1 - 2 * (i + 0.5) / kDirections, around = i * std::numbers::pi * (3 - std::sqrt(5.0));
      const double r = std::sqrt(1 - z * z);
      all.push_back({Vector3d(r * std::cos(around), r * std::sin(around), z), {0, 0}});
    }
    return all;
  }
  const bool is_rod = shape.kind() == ShapeKind::rod;
  const auto steps = [](double reach) { return static_cast<int>(std::ceil(reach / kStepMm)); };
  const int across = is_rod ? 0 : steps(reach_mm.y()), along = steps(reach_mm.x());
  for (int roll = 0; roll < (is_rod ? kRolls : 1); ++roll)
    for (int i = -along; i <= along; ++i)
      for (int j = -across; j <= across; ++j) {
        const double angle = 2 * std::numbers::pi * roll / kRolls;
        all.push_back(
            {Vector3d(0, std::sin(angle), std::cos(angle)),
             Vector2d(i * reach_mm.x() / std::max(1, along), j * reach_mm.y() / std::max(1, across))});
      }
  return all;
}

}  // namespace

VirtualHand::VirtualHand(ShapePtr shape, const SensorGeometry& geometry, double speed_mm_s,
                         std::uint64_t seed)
    : shape_(std::move(shape)),
      geometry_(geometry),
      step_mm_(speed_mm_s / kRateHz),
      random_(seed),
      gel_(flat_gel(geometry)) {}

Vector2d VirtualHand::reach_mm() const {
  const Vector2d half = 0.5 * shape_->bounds_mm().sizes().head<2>().cast<double>();
  return (half.array() - kMarginMm).max(0.0);
}

void VirtualHand::put(const Vector3d& direction, const Vector2d& place_mm) {
  frames_ = 0;
  sensor_T_object_.linear() =
      direction.z() > 1 - 1e-9
          ? AngleAxisd(std::numbers::pi, Vector3d::UnitX()).toRotationMatrix()
          : Eigen::Quaterniond::FromTwoVectors(direction, -Vector3d::UnitZ()).toRotationMatrix();
  const Vector3d middle = shape_->bounds_mm().center().cast<double>();
  const bool is_body = shape_->kind() == ShapeKind::body;
  const Vector3d below = is_body ? middle : middle + Vector3d(place_mm.x(), place_mm.y(), 0);
  sensor_T_object_.translation() = -(sensor_T_object_.linear() * below);
  const Vector3d half = 0.5 * shape_->bounds_mm().sizes().cast<double>();
  sensor_T_object_.translation().z() += sensor_T_object_.linear().row(2).cwiseAbs().dot(half);
  settle(kDepthMm);
  center(1);
  settle(kDepthMm);
}

/// Keeps the height where the object is not above the gel at all.
void VirtualHand::settle(double depth_mm) {
  if (const auto settled = settle_object(*shape_, sensor_T_object_, depth_mm, geometry_, {}))
    sensor_T_object_ = *settled;
  gel_ = press_object(*shape_, sensor_T_object_, geometry_, {});
}

/// Only a body needs to be followed; a rod's axis and a plate's middle stay where they are put.
void VirtualHand::center(double gain) {
  if (shape_->kind() != ShapeKind::body) return;
  if (const auto middle = contact_middle(gel_, geometry_))
    sensor_T_object_.translation().head<2>() -= gain * *middle;
}

/// Only as far as the object reaches.
bool VirtualHand::slide(const Vector2d& step_mm) {
  if (shape_->kind() == ShapeKind::body) return true;
  const Vector3d step = sensor_T_object_.linear().transpose() * Vector3d(step_mm.x(), step_mm.y(), 0);
  const Vector3d from = place_mm() - shape_->bounds_mm().center().cast<double>();
  Vector2d to = from.head<2>() + step.head<2>();
  const Vector2d wanted = to, reach = reach_mm();
  to = to.cwiseMin(reach).cwiseMax(-reach);
  if (shape_->kind() == ShapeKind::rod) to.y() = from.y();
  const Vector3d by = Vector3d(to.x() - from.x(), to.y() - from.y(), 0);
  sensor_T_object_.translation() -= sensor_T_object_.linear() * by;
  return std::abs(to.x() - wanted.x()) < 1e-9 &&
         (shape_->kind() == ShapeKind::rod || std::abs(to.y() - wanted.y()) < 1e-9);
}

bool VirtualHand::move(const Vector2d& direction) {
  std::normal_distribution<double> normal;
  const double kept = std::exp(-1 / (kSteadyS * kRateHz)), fresh = std::sqrt(1 - kept * kept);
  const double twist_before = unsteady_[1];
  for (double& part : push_) part = kept * part + fresh * normal(random_);
  unsteady_ = kept * unsteady_ + (1 - kept) * std::numbers::sqrt2 * push_;
  const double pressed = std::min(1.0, 0.3 + 0.7 * ++frames_ / kPressInFrames);
  const double depth_mm = pressed * kDepthMm * std::max(0.5, 1 + kDepthShare * unsteady_[2]);
  if (frames_ < kPressInFrames) {
    settle(depth_mm);
    return true;
  }
  const Vector2d d = Eigen::Rotation2Dd(kHeadingRad * unsteady_[0]) * direction;
  const Vector3d axis = sensor_T_object_.linear().col(0);  // of a rod
  const ShapeKind kind = shape_->kind();
  Vector3d turn(-d.y(), d.x(), 0);
  Vector2d shift = d;
  if (kind == ShapeKind::body) shift.setZero();
  if (kind == ShapeKind::rod) turn = axis * axis.dot(turn), shift = axis.head<2>() * axis.head<2>().dot(d);
  if (kind == ShapeKind::flat) turn.setZero();
  const Vector3d middle = sensor_T_object_ * shape_->bounds_mm().center().cast<double>();
  turn *= step_mm_ / std::max(1.0, std::abs(middle.z()));
  turn.z() += kTwistRad * (unsteady_[1] - twist_before);
  if (const double angle = turn.norm(); angle > 0) {
    const AngleAxisd by(angle, turn / angle);
    sensor_T_object_.linear() = by * sensor_T_object_.linear();
    sensor_T_object_.translation() = by * (sensor_T_object_.translation() - middle) + middle;
  }
  const bool went = slide(step_mm_ * shift);
  center(kCentering);
  settle(depth_mm);
  return went;
}

std::vector<bool> reachable(const ShapePtr& shape, const SensorGeometry& geometry,
                            const std::vector<Vector3d>& points_mm) {
  constexpr double kOnGelMm = 0.1;
  const std::vector<Position> all = positions(*shape, VirtualHand(shape, geometry, 1, 1).reach_mm());
  std::vector<std::vector<bool>> touched(all.size(), std::vector<bool>(points_mm.size()));
  parallel_for(all.size(), 0, [&](std::size_t i) {
    VirtualHand hand(shape, geometry, 1, 1);
    hand.put(all[i].direction, all[i].place_mm);
    for (std::size_t k = 0; k < points_mm.size(); ++k) {
      const Vector3d p = hand.sensor_T_object() * points_mm[k];
      const int u = cvRound(p.x() / geometry.pixel_pitch_mm + 0.5 * geometry.width_px - 0.5);
      const int v = cvRound(p.y() / geometry.pixel_pitch_mm + 0.5 * geometry.height_px - 0.5);
      if (u < 0 || v < 0 || u >= geometry.width_px || v >= geometry.height_px) continue;
      touched[i][k] =
          hand.press().contact(v, u) != 0 && std::abs(p.z() - hand.press().height_mm(v, u)) < kOnGelMm;
    }
  });
  std::vector<bool> result(points_mm.size());
  for (const std::vector<bool>& one : touched)
    for (std::size_t k = 0; k < one.size(); ++k) result[k] = result[k] || one[k];
  return result;
}

}  // namespace gelslam::lab
