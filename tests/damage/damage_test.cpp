// Whatever the bytes, a reader gives a result or an Error in one line, in silence and within its memory:
// never a crash, a hang or another exception. One list of damages for the files of every format.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "../sensor/raw_frames.hpp"
#include "../slam/small_map.hpp"
#include "../support/peak_memory.hpp"
#include "../surface/pth_file.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/core/crc32.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/packed_surface.hpp"

namespace gelslam::test {
namespace {

struct Format {
  const char* file;
  std::function<void(const fs::path&)> write, read;
  bool cuts_can_be_read = false;  ///< what comes before the cut
  bool may_be_empty = false;
};

Mesh triangle() {
  Mesh mesh;
  mesh.vertices_mm = {{0.1F, 0.2F, 0.3F}, {10.1F, 0.2F, 0.3F}, {0.1F, 9.7F, 0.3F}};
  mesh.normals.assign(3, Eigen::Vector3f::UnitZ());
  mesh.confidence = {0, 1.5F, 2};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

/// What is in a network's file, with the pickle in its former or its present form.
std::map<std::string, std::string> network(int protocol = 2) {
  PthFile file;
  file.protocol = protocol;
  file.layers = random_layers(7);
  return file.entries();
}

/// A pickle in an archive whose checksums fit.
void read_pickle(const fs::path& path) {
  static auto entries = network();
  entries["nnmodel/data.pkl"] = read_bytes(path);
  const std::string archive = zip_archive(entries);
  parse_pth_model({reinterpret_cast<const unsigned char*>(archive.data()), archive.size()}, path.string());
}

/// With the checksum made to fit: what a surface's bytes then say is checked, too.
void read_packed_surface(const fs::path& path) {
  std::string bytes = read_bytes(path);
  if (bytes.size() > 12) {
    const std::uint32_t sum = crc32_of(std::string_view(bytes).substr(12));
    std::memcpy(bytes.data() + 8, &sum, sizeof sum);
  }
  PackedSurface::from_bytes(bytes).unpack();
}

void read_pictures(const fs::path& path) {
  SensorProfile profile;
  profile.width_px = 64;
  profile.height_px = 48;
  const auto source = open_frame_source(path, profile);
  for (int frames = 0; frames < 100 && source->next(); ++frames) {
  }
}

void write_log(const fs::path& path) {
  LogWriter writer(path, {"GelSight Mini", "exposure 100\n", "device_config:\n", std::string(900, 'm')}, 25);
  for (int i = 0; i < 6; ++i) writer.write(jpeg_frame(i));
}

void write_picture(const fs::path& path) { cv::imwrite(path.string(), numbered_picture(5, 64, 48)); }
void write_mesh_file(const fs::path& path) { write_mesh(path, triangle()); }
void read_mesh_file(const fs::path& path) {
  const Mesh mesh = read_mesh(path);
  for (const Eigen::Vector3i& t : mesh.triangles)
    ASSERT_LT(static_cast<std::size_t>(t.maxCoeff()), mesh.vertices_mm.size());
}

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
      {"a.npy",
       [](const fs::path& p) {
         write_npy(p, {2, 3}, std::vector<double>(6, 0.5));
       },
       [](const fs::path& p) { read_npy(p); }},
      {"model.json",
       [](const fs::path& p) {
         write_model_file(p, {random_model(1), {}});
       },
       [](const fs::path& p) { read_model(p); }},
      {"model.pth", [](const fs::path& p) { write_bytes(p, zip_archive(network())); },
       [](const fs::path& p) { read_model(p); }},
      {"data.pkl", [](const fs::path& p) { write_bytes(p, network()["nnmodel/data.pkl"]); }, read_pickle},
      {"data4.pkl", [](const fs::path& p) { write_bytes(p, network(4)["nnmodel/data.pkl"]); }, read_pickle},
      {"m.ply", write_mesh_file, read_mesh_file},
      {"m.stl", write_mesh_file, read_mesh_file},
      {"m.obj", write_mesh_file, read_mesh_file, true},
      {"a.png", write_picture, [](const fs::path& p) { read_image(p); }},
      {"a.jpg", write_picture, [](const fs::path& p) { read_image(p); }},
      {"a.bmp", write_picture, [](const fs::path& p) { read_image(p); }},
      {"log.mkv", write_log,
       [](const fs::path& p) {
         read_log_attachments(p);
         read_pictures(p);
       },
       true},
      {"a.avi", [](const fs::path& p) { write_video(p, "MJPG", 6, 64, 48); }, read_pictures, true},
      {"a.mp4", [](const fs::path& p) { write_video(p, "mp4v", 6, 64, 48); }, read_pictures, true},
      {"session.db", [](const fs::path& p) { write_store(p.parent_path(), small_map()); },
       [](const fs::path& p) { load_saved_map(p.parent_path()); }},
      {"session.db/record", [](const fs::path& p) { write_store(p.parent_path(), small_map()); },
       [](const fs::path& p) { read_scan(p.parent_path(), {}); }},
      {"surface",
       [](const fs::path& p) {
         write_bytes(p, PackedSurface(*small_map().keyframes[0]->surface.get()).bytes());
       },
       read_packed_surface},
      {"report.json", [](const fs::path& p) { write_bytes(p, report_json(RunReport())); },
       [](const fs::path& p) { find_report(p.parent_path()); }},
      {"a.tum",
       [](const fs::path& p) { write_bytes(p, "0.4 0.001 0 0 0 0 0 1\n0.8 0.003 0.004 0 0 0 0 1\n"); },
       [](const fs::path& p) { read_tum(p); }, true, true},
      {"config.yaml", [](const fs::path& p) { write_bytes(p, write_config(Config{})); },
       [](const fs::path& p) { read_config(p); }, true, true},
      {"optics.yaml", [](const fs::path& p) { write_optics(p, {}); },
       [](const fs::path& p) { read_optics(p); }, true, true},
      {"label.npz",
       [](const fs::path& p) {
         write_label(p, {100.5, 60.25, 30.0});
       },
       [](const fs::path& p) { read_label(p); }},
  };
  return all;
}

class Damaged : public testing::TestWithParam<std::size_t> {
 protected:
  Damaged() {
    format.write(file);
    good = read_bytes(file);
  }
  /// The message, or nothing if there is a result.
  std::string read(const std::string& bytes) {
    write_bytes(file, bytes);
    std::string message;
    try {
      format.read(file);
    } catch (const Error& error) {
      message = error.what();
      EXPECT_NE(message, "");
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    return message;
  }

  const Format& format = formats()[GetParam()];
  const TemporaryFolder folder;
  const fs::path file = folder / fs::path(format.file).begin()->string();
  std::string good;
};

TEST_P(Damaged, IsAnErrorInOneLineOrWhatCanBeRead) {
  EXPECT_EQ(read(good), "");
  testing::internal::CaptureStderr();
  const std::size_t grown = memory_growth([&] {
    for (const std::string& other : {std::string(), std::string(5000, '\0'), std::string(5000, '\xa7'),
                                     std::string(200'000, '['), std::string("this is another file\n")})
      if (const std::string message = read(other); !other.empty() || !format.may_be_empty) {
        EXPECT_NE(message, "") << other.substr(0, 8);
      }
    for (std::size_t length = 1; length < good.size(); length += good.size() / 60 + 1) {
      const std::string message = read(good.substr(0, length));
      EXPECT_TRUE(format.cuts_can_be_read || message != "") << "cut at " << length << " of " << good.size();
    }
    std::mt19937 random(7 + static_cast<unsigned>(GTEST_FLAG_GET(random_seed)));
    for (int round = 0; round < 200; ++round) {
      std::string bad = good;
      for (auto changes = 1 + random() % 20; changes > 0; --changes) {
        // Half of them where a file or a page of a database begins: there is what leads to all else.
        const std::size_t at = random() % bad.size();
        bad[random() % 2 ? at : at / 4096 * 4096 + at % 64 % bad.size()] = static_cast<char>(random());
      }
      if (round % 8 == 0) bad.insert(random() % bad.size(), 1 + random() % 8, static_cast<char>(random()));
      if (round % 8 == 1) bad.erase(random() % bad.size(), 1 + random() % 8);
      read(bad);
    }
  });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_LT(grown, std::size_t{300} << 20);
}

INSTANTIATE_TEST_SUITE_P(File, Damaged, testing::Range(std::size_t{0}, formats().size()),
                         [](const auto& info) {
                           std::string name = formats()[info.param].file;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

}  // namespace
}  // namespace gelslam::test
