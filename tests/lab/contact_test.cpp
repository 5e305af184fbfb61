#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "../support/run_program.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/surface/model_file.hpp"
#include "simulated_frames.hpp"

namespace gelslam {
namespace {

using namespace test;
using Json = nlohmann::ordered_json;

/// A short scan that lifts off.
struct Scan {
  Scan() {
    ScanSpec spec;
    spec.object.name = "pebble";
    spec.motion.name = "breaks";
    spec.motion.frames = 30;
    DataFolderOptions options;
    options.model = folder / "nnmodel.pth";
    write_pth_model(options.model, lab::simulated_frames().model);
    NoProgress quiet;
    write_data_folder(log, Simulator(spec), options, quiet);
  }

  Json measured() const {
    const ProgramResult result = run_program(GELSLAM_LAB, {"contact", log, "-o", folder / "study"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(read_bytes(folder / "study/contact.json")).at(0);
  }

  TemporaryFolder folder;
  std::filesystem::path log = folder / "scan";
};

TEST(ContactStudy, CountsWhatIsMissedAndWhatIsNotTouched) {
  const Scan scan;
  const LogInput input{.log = scan.log};
  StageTimer timer;
  SurfaceStream stream(input, resolve_config(input), timer);
  double left_share = 0, right_share = 0;
  int touched = 0, frames = 0, beside_px = 0;
  while (const auto item = stream.next()) {
    if (!item->surface) continue;
    ++frames;
    // The truth becomes the right half of what is read.
    cv::Mat1b truth = item->surface->contact.clone();
    const int all = cv::countNonZero(truth), middle = truth.cols / 2;
    truth.colRange(0, middle).setTo(0);
    const int right = cv::countNonZero(truth);
    if (right > 0) {
      ++touched;
      right_share += static_cast<double>(right) / all;
      left_share += 1 - static_cast<double>(right) / all;
    } else {
      beside_px += all;
    }
    write_png(contact_file(scan.log, item->image.index), truth);
  }
  const Json row = scan.measured();
  EXPECT_EQ(row["touched_frames"], touched);
  EXPECT_EQ(row["untouched_frames"], frames - touched);
  EXPECT_GT(touched, 10);
  EXPECT_LT(touched, frames);
  EXPECT_NEAR(row["iou"], right_share / touched, 1e-9);
  EXPECT_NEAR(row["not_touched"], left_share / touched, 1e-9);
  EXPECT_EQ(row["missed"], 0);
  EXPECT_EQ(row["contact_px_there"], static_cast<double>(beside_px) / (frames - touched));
}

}  // namespace
}  // namespace gelslam
