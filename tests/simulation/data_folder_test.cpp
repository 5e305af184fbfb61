#include "gelslam/simulation/data_folder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "gelslam/core/npy.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/simulation/shape.hpp"
#include "temporary_folder.hpp"

namespace gelslam {
namespace {

using namespace test;

const Simulator& simulator() {
  static const Simulator instance([] {
    ScanSpec spec;
    spec.object.name = "plank";  // colorful, and quick to draw
    spec.motion.name = "breaks";
    spec.motion.frames = 15;
    return spec;
  }());
  return instance;
}

// The seed changes object and motion; a mesh is what it is.
TEST(Simulator, ScansTheSameObjectTwiceByItsMesh) {
  const TemporaryFolder folder;
  write_mesh(folder / "gt_mesh.ply", simulator().surface(), LengthUnit::meter);
  ScanSpec spec = simulator().spec();
  spec.motion.seed = spec.object.seed = 2;
  const Simulator other(spec);
  spec.object.name = (folder / "gt_mesh.ply").string();
  const Simulator again(spec);
  const auto at_the_middle = [](const Simulator& scan) {
    const Shape& shape = scan.shape();
    return shape.intersect({1, 1, 30}, {0, 0, -1}, 60);
  };
  EXPECT_NEAR(at_the_middle(again), at_the_middle(simulator()), 0.005);
  EXPECT_GT(std::abs(at_the_middle(other) - at_the_middle(simulator())), 0.01);
  const auto moved = again.frame(18).start_T_sensor, first = simulator().frame(18).start_T_sensor;
  ASSERT_TRUE(moved && first);
  EXPECT_FALSE(moved->isApprox(*first, 1e-3));
}

/// A data folder with what the options say, gone with the test.
class Written {
 public:
  explicit Written(const DataFolderOptions& options) {
    NoProgress progress;
    write_data_folder(path(), simulator(), options, progress);
  }
  std::filesystem::path path() const { return parent_ / "scan"; }
  std::filesystem::path operator/(const std::string& name) const { return path() / name; }

 private:
  TemporaryFolder parent_;
};

/// Mean absolute difference per channel between the video and the pictures that went in.
cv::Vec3d video_error(const std::filesystem::path& folder) {
  const auto source = open_frame_source(folder, SensorProfile{});
  cv::Vec3d sum(0, 0, 0);
  int frames = 0;
  while (const auto image = source->next()) {
    cv::Mat3b difference;
    cv::absdiff(image->bgr, simulator().frame(frames).bgr, difference);
    const cv::Scalar mean = cv::mean(difference);
    sum += cv::Vec3d(mean[0], mean[1], mean[2]);
    ++frames;
  }
  EXPECT_EQ(frames, simulator().frame_count());
  return sum / static_cast<double>(std::max(frames, 1));
}

TEST(DataFolder, VideoHoldsThePicturesWithTheirColor) {
  const cv::Vec3d error = video_error(Written(DataFolderOptions{}).path());
  // With halved color resolution the error here is 1.5 to 1.7 gray levels.
  for (int c = 0; c < 3; ++c) EXPECT_LT(error[c], 1.3) << c;
}

TEST(DataFolder, TruthIsInMetersOnePoseForEveryFrameAfterTheBackground) {
  const Written folder(DataFolderOptions{});
  const NpyArray poses = read_npy(folder / "true_start_T_currs.npy");
  EXPECT_EQ(poses.type, NpyType::float64);
  ASSERT_EQ(poses.shape, (std::vector<std::size_t>{15, 4, 4}));
  const std::vector<double> values = poses.to_doubles();
  int lifted = 0;
  for (int k = 0; k < 15; ++k) {
    const auto pose = simulator().frame(10 + k).start_T_sensor;
    const double* matrix = values.data() + 16 * k;
    if (!pose) {
      ++lifted;
      for (int i = 0; i < 16; ++i) EXPECT_TRUE(std::isnan(matrix[i]));
      continue;
    }
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(matrix[4 * row + 3], 1e-3 * pose->translation()[row], 1e-12);
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(matrix[4 * row + column], pose->linear()(row, column));
    }
  }
  EXPECT_GT(lifted, 0);
  EXPECT_LT(lifted, 10);
}

TEST(DataFolder, TouchedPointsAreVerticesOfTheMeshOnItsFace) {
  const Written folder(DataFolderOptions{});
  const Mesh mesh = read_mesh(folder / "gt_mesh.ply");
  ASSERT_EQ(mesh.vertices_mm.size(), simulator().surface().vertices_mm.size());
  EXPECT_LT((mesh.vertices_mm[100] - simulator().surface().vertices_mm[100]).norm(), 1e-4F);
  const NpyArray touched = read_npy(folder / "touched.npy");
  EXPECT_EQ(touched.type, NpyType::float32);
  ASSERT_EQ(touched.shape.size(), 2u);
  ASSERT_GT(touched.shape[0], 1000u);
  ASSERT_EQ(touched.shape[1], 3u);
  const std::vector<double> points = touched.to_doubles();
  for (std::size_t k = 0; k < touched.shape[0]; ++k) {
    ASSERT_GT(points[3 * k + 2], -0.5e-3);                           // the face, not the back
    ASSERT_LT(std::hypot(points[3 * k], points[3 * k + 1]), 20e-3);  // the view, moved by the wobble
  }
}

TEST(DataFolder, WallsAndBackOfAThinPlateAreNotTouched) {
  ScanSpec spec;
  spec.object.name = "plank";
  spec.object.texture = 0;
  spec.object.size = 0.17;  // 7.5 x 5.4 x 1.0 mm, edges rounded by 0.5 mm: its back sinks in, too
  spec.motion.frames = 12;
  spec.motion.indentation_mm = 1.5;
  const TemporaryFolder parent;
  NoProgress progress;
  write_data_folder(parent / "scan", Simulator(spec), {}, progress);
  const std::vector<double> points = read_npy(parent / "scan" / "touched.npy").to_doubles();
  double lowest = 0;
  for (std::size_t k = 2; k < points.size(); k += 3) lowest = std::min(lowest, points[k]);
  EXPECT_LT(lowest, -0.05e-3);  // the gel bends round the edge,
  EXPECT_GT(lowest, -0.55e-3);  // but does not go behind it
}

TEST(DataFolder, IsTheSameWhateverTheNumberOfThreads) {
  DataFolderOptions one, three;
  one.threads = 1;
  three.threads = 3;
  const Written a(one), b(three);
  ASSERT_EQ(names_in(a.path()).size(), 8u);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(a.path())) {
    const std::string name = entry.path().lexically_relative(a.path()).string();
    if (entry.is_directory()) continue;
    EXPECT_TRUE(read_bytes(a / name) == read_bytes(b / name)) << name;
  }
}

TEST(DataFolder, HasTheContactOfEveryFrameAfterTheBackground) {
  const Written folder(DataFolderOptions{});
  EXPECT_EQ(names_in(folder / "contact").size(), 15u);
  EXPECT_EQ(contact_file("scan", 24), "scan/contact/000024.png");
  for (const int index : {10, 17, 24}) {
    const cv::Mat picture = cv::imread(contact_file(folder.path(), index).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(picture.type(), CV_8UC1);
    EXPECT_EQ(cv::norm(picture, simulator().frame(index).contact, cv::NORM_INF), 0) << index;
  }
}

}  // namespace
}  // namespace gelslam
