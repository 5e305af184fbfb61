#include "synthetic_touch.hpp"

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace gelslam::test {

Field slab(const Eigen::Vector3d& half_size_mm, double rounding_mm) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = (p.cwiseAbs() - half_size_mm).array() + rounding_mm, beyond = q.cwiseMax(0.0);
    int axis = 0;
    const double inside = std::min(q.maxCoeff(&axis), 0.0);
    const Eigen::Vector3d out = inside < 0 ? Eigen::Vector3d::Unit(axis) : beyond.normalized();
    return std::pair{beyond.norm() + inside - rounding_mm, Eigen::Vector3d(out.cwiseProduct(p.cwiseSign()))};
  };
}

Pose press(const Field& field, const Eigen::Vector3d& side, double depth_mm, double twist_rad,
           const Eigen::Vector2d& offset_mm) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d z = -side.normalized();  // out of the gel toward the object
  pose.linear() =
      rotation_of_z_to(z) * Eigen::AngleAxisd(twist_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = pose.linear() * Eigen::Vector3d(offset_mm.x(), offset_mm.y(), 0);
  constexpr double far_mm = 10;
  double lowest = far_mm;
  for (double y = -7.6; y < 7.7; y += 0.2)
    for (double x = -10.1; x < 10.2; x += 0.2) {
      double height = 0;
      Eigen::Vector3d normal;
      if (follow_ray(field, pose, x, y, -far_mm, height, normal)) lowest = std::min(lowest, height);
    }
  pose.translation() += pose.linear().col(2) * (lowest + depth_mm);
  return pose;
}

SurfacePtr measured(const Field& field, const Pose& object_T_sensor) {
  const auto surface = touch(field, object_T_sensor, everywhere());
  const cv::Mat1b true_contact = surface->contact.clone();
  cv::dilate(true_contact, surface->contact, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  surface->height_mm.setTo(0, true_contact == 0);
  surface->normals.setTo(cv::Scalar(0, 0, 1), true_contact == 0);
  cv::Mat1f hanging;
  cv::GaussianBlur(surface->height_mm, hanging, {0, 0}, 6.0);
  hanging.copyTo(surface->height_mm, true_contact == 0);
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

PosedSurface with_errors(int id, const Field& field, const Pose& object_T_sensor, const Errors& errors,
                         std::mt19937_64& random) {
  auto surface = std::make_shared<Surface>(*measured(field, object_T_sensor));
  cv::Mat1f noise;
  cv::extractChannel(noise_field(surface->height_mm.size(), 6.0, random()), noise, 0);
  surface->height_mm = surface->height_mm * (1.0 + errors.height_gain * normal_deviate(random)) +
                       errors.height_noise_mm * noise;
  Vector6d wrong;
  for (int i = 0; i < 6; ++i)
    wrong[i] = normal_deviate(random) * (i < 3 ? errors.rotation_rad : errors.translation_mm);
  return {id, object_T_sensor * se3_exp(wrong), SurfacePtr(surface)};
}

std::vector<PosedSurface> roll(const Field& field, int n, double half_length_mm, double depth_mm,
                               const Errors& errors, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<PosedSurface> patches;
  for (int i = 0; i < n; ++i) {
    const double turn = 2 * std::numbers::pi * i / n;
    const double lean = 0.9 * std::sin(5 * turn + 0.3) * half_length_mm;  // toward one end and the other
    const Eigen::Vector3d side(std::sin(lean), std::cos(lean) * std::cos(turn),
                               std::cos(lean) * std::sin(turn));
    patches.push_back(with_errors(i, field, press(field, side, depth_mm, 0.3 * i), errors, random));
  }
  return patches;
}

}  // namespace gelslam::test
