// Tests changes of the pictures of a log. One picture is replaced by one that was damaged on the way from the
// camera, or by a picture of something else. In other tests, all pictures have more or fewer pixels.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "../support/pixel_map.hpp"
#include "../surface/linear_gel.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam::test {
namespace {

constexpr std::size_t kFrames = 16, kReplaced = 8;
const cv::Size kSize(320, 240);

/// Returns the height (mm) of a ball with the radius 12 mm and with bumps, pressed in by 0.7 mm, at x and y
/// in the frame of the object.
double object_mm(double x, double y) {
  return (x * x + y * y) / 24 - 0.7 + 0.04 * std::sin(2.1 * x + 0.7 * y) * std::cos(1.7 * y - 0.4 * x) +
         0.03 * std::sin(3.3 * x - 2.9 * y);
}

/// Returns the height at x and y of the sensor frame, in which the object moves by 0.06 mm and 0.5 degrees
/// per frame.
double object_mm(double frame, double x, double y) {
  const double turn = 0.5 * frame / kDegreesPerRadian;
  x -= 0.06 * frame;
  y += 0.03 * frame;
  return object_mm(std::cos(turn) * x + std::sin(turn) * y, std::cos(turn) * y - std::sin(turn) * x);
}

cv::Mat1f height_of(int frame) {
  return pixel_map<float>(kSize, [&](int u, int v) {
    return std::min(0.0, object_mm(frame, kPitchMm * (u - 159.5), kPitchMm * (v - 119.5)));
  });
}

/// Returns the picture of a height map, on a gel that is darker toward its border.
cv::Mat3b picture_of(const cv::Mat1f& height, int seed) {
  cv::Mat3b picture = render(height, kPitchMm, 1.0, static_cast<std::uint64_t>(seed));
  // This does not use forEach(), because the thread sanitizer reports its threads.
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      const double x = u / 160.0 - 1, y = v / 120.0 - 1;
      for (int c = 0; c < 3; ++c)
        picture(v, u)[c] =
            cv::saturate_cast<uchar>(picture(v, u)[c] * (1.0 - (0.2 + 0.05 * c) * x * x - 0.1 * y * y));
    }
  return picture;
}

cv::Mat3b rolled(const cv::Mat3b& bgr, int shift_px, int from_row = 0, int to_row = kSize.height) {
  return pixel_map<cv::Vec3b>(bgr.size(), [&](int u, int v) {
    return v < from_row || v >= to_row ? bgr(v, u) : bgr(v, (u - shift_px + bgr.cols) % bgr.cols);
  });
}

cv::Mat3b noise() {
  cv::Mat3b picture(kSize);
  cv::RNG(7).fill(picture, cv::RNG::UNIFORM, 0, 256);
  return picture;
}

/// Returns a picture as a JPEG decoder makes it of damaged data: a part is shifted, and the rest has other
/// colors.
cv::Mat3b block_shifted(const cv::Mat3b& bgr) {
  cv::Mat3b result = rolled(bgr, 16, 120, 184);
  cv::Mat3b rest = result.rowRange(184, kSize.height);
  cv::add(rest, cv::Scalar(8, -5, 12), rest);
  return result;
}

/// Returns the map of a log. `larger`: the sides of the pictures divided by those of kSize.
SlamMap map_of(const std::vector<cv::Mat3b>& pictures, const cv::Mat3b& background, double larger = 1) {
  SurfaceOptions options;
  options.pixel_pitch_mm = kPitchMm / larger;
  SurfaceEstimator estimator(linear_gel_model(), background, options);
  GelSlam slam{SlamOptions{}};
  StageTimer timer;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    slam.process(static_cast<std::int64_t>(i), 0.04 * static_cast<double>(i), estimator.estimate(pictures[i]),
                 timer);
  return slam.finish();
}

/// Returns the largest distance (mm) between the mesh and the true object.
double largest_error_mm(const SlamMap& map) {
  const auto frame = static_cast<double>(map.anchor_frame);
  const Mesh mesh = fuse(posed_surfaces(snapshot_of(map)), FusionOptions{});
  double largest = 0;
  for (const Eigen::Vector3f& p : mesh.vertices_mm)
    largest = std::max(largest, std::abs(p.z() - object_mm(frame, p.x(), p.y())));
  return largest;
}

/// Returns the pose of a frame in the first frame.
Pose first_T_frame(const SlamMap& map, std::size_t frame) {
  const MapSnapshot placed = snapshot_of(map);
  const auto pose = [&](const FrameRecord& f) { return placed.pose_of(f)->map_T_frame.pose; };
  return pose(map.frames[0]).inverse() * pose(map.frames[frame]);
}

TEST(ReplacedPicture, LeavesNoTraceInTheMapAndTheMesh) {
  const cv::Mat3b bare = picture_of(cv::Mat1f(kSize, 0.0F), 99);
  std::vector<cv::Mat3b> pictures;
  for (int i = 0; i < static_cast<int>(kFrames); ++i) pictures.push_back(picture_of(height_of(i), i));
  const SlamMap whole = map_of(pictures, bare);
  ASSERT_EQ(whole.components, 1);
  const double usual_mm = largest_error_mm(whole);
  EXPECT_LT(usual_mm, 0.15) << "at the rim, where the gel would be lifted";
  const cv::Mat3b right = pictures[kReplaced];
  std::vector<std::pair<std::string, cv::Mat3b>> others = {
      {"noise", noise()}, {"bare", bare}, {"early", pictures[1]}, {"blocks", block_shifted(right)}};
  // A shift by a fifth of the gel or more would be a jump, after which relocalization would find the object.
  for (const int shift_px : {4, -8, 12, -23}) {
    others.emplace_back("rolled by " + std::to_string(shift_px), rolled(right, shift_px));
    others.emplace_back("lower rows rolled by " + std::to_string(shift_px), rolled(right, shift_px, 140));
  }
  for (const auto& [name, picture] : others) {
    pictures[kReplaced] = picture;
    const SlamMap map = map_of(pictures, bare);
    EXPECT_LT(largest_error_mm(map), usual_mm + 0.05) << name;
    for (std::size_t i = 0; i < kFrames; ++i) {
      if (i == kReplaced) continue;
      SCOPED_TRACE(name + ", frame " + std::to_string(i));
      ASSERT_TRUE(map.has_pose(map.frames[i]));
      expect_within(gap(first_T_frame(whole, i), first_T_frame(map, i)), 0.3, 0.03);
    }
  }
}

cv::Mat3b resized(const cv::Mat3b& picture, double larger) {
  cv::Mat3b result;
  cv::resize(picture, result, {}, larger, larger, larger > 1 ? cv::INTER_CUBIC : cv::INTER_AREA);
  return result;
}

TEST(ResizedPictures, HaveTheSameMotionsAndSigmas) {
  const cv::Mat3b bare = picture_of(cv::Mat1f(kSize, 0.0F), 99);
  std::vector<cv::Mat3b> pictures;
  for (int i = 0; i < static_cast<int>(kFrames); ++i) pictures.push_back(picture_of(height_of(i), i));
  const SlamMap usual = map_of(pictures, bare);
  for (const double larger : {0.75, 1.5}) {
    std::vector<cv::Mat3b> others;
    for (const cv::Mat3b& picture : pictures) others.push_back(resized(picture, larger));
    const SlamMap map = map_of(others, resized(bare, larger), larger);
    double sigma = 0, usual_sigma = 0;
    for (std::size_t i = 0; i < kFrames; ++i) {
      SCOPED_TRACE("times " + std::to_string(larger) + ", frame " + std::to_string(i));
      ASSERT_TRUE(map.has_pose(map.frames[i]));
      expect_within(gap(first_T_frame(usual, i), first_T_frame(map, i)), 0.3, 0.02);
      sigma += std::sqrt(map.frames[i].covariance.trace());
      usual_sigma += std::sqrt(usual.frames[i].covariance.trace());
    }
    EXPECT_NEAR(sigma / usual_sigma, 1, 0.15) << larger;
  }
}

}  // namespace
}  // namespace gelslam::test
