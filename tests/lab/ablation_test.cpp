#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/run_program.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/model_file.hpp"
#include "simulated_frames.hpp"

namespace gelslam {
namespace {

using namespace test;
using lab::simulated_frames;
using Json = nlohmann::ordered_json;

/// A set of one short log.
struct SmallSet {
  SmallSet() {
    ScanSpec spec;
    spec.object.name = "pebble";
    spec.motion.frames = 90;
    DataFolderOptions options;
    options.model = folder / "nnmodel.pth";
    write_pth_model(options.model, simulated_frames().model);
    NoProgress quiet;
    write_data_folder(log, Simulator(spec), options, quiet);
  }

  Json measured(std::vector<std::string> arguments) const {
    const std::string study = folder / "study";
    arguments.insert(arguments.begin(), {"ablation", folder / "set"});
    arguments.insert(arguments.end(), {"-o", study});
    const ProgramResult result = run_program(GELSLAM_LAB, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? Json::parse(read_bytes(study + "/ablation.json")) : Json::array();
  }

  /// By the program's own way through run folders.
  Evaluation evaluated(bool refine) const {
    ReconstructRequest request;
    request.input.log = log;
    request.config = resolve_config(request.input);
    if (!refine) request.config.slam.refinement.max_pairs_per_keyframe = 0;
    request.run_folder = folder / "run";
    request.overwrite = true;
    NoProgress quiet;
    reconstruct(request, quiet, [] { return false; });
    const Comparison comparison = compare(request.run_folder, log);
    return evaluate(comparison, place_meshes(comparison));
  }

  TemporaryFolder folder;
  std::filesystem::path log = folder / "set/pebble";
};

TEST(Ablation, AgreesWithReconstructAndEvaluate) {
  const SmallSet set;
  const Json rows = set.measured({"--only", "overlap edges"});
  ASSERT_EQ(rows.size(), 2U);
  for (const int row : {0, 1}) {
    const Evaluation expected = set.evaluated(/*refine=*/row == 0);
    EXPECT_NEAR(rows[row]["error_mm"], expected.trajectory->geometric_mean_mm, 1e-6);
    EXPECT_NEAR(rows[row]["mesh_mm"], expected.mesh->at_known_pose.accuracy.mean_mm, 1e-4);
    EXPECT_EQ(rows[row]["share"], expected.trajectory->tracked_share());
    EXPECT_EQ(rows[row]["frames"], 90);
    EXPECT_EQ(rows[row]["silent"], 0);
    EXPECT_GT(rows[row]["error_over_sigma"], 0.05);
    EXPECT_LT(rows[row]["error_over_sigma"], 3);
  }
  EXPECT_NE(rows[0]["error_mm"], rows[1]["error_mm"]);
  const Json ratios = Json::parse(read_bytes(set.folder / "study/ablation_ratios.json"));
  ASSERT_EQ(ratios.size(), 1U);
  EXPECT_EQ(ratios[0]["set"], "set");
  EXPECT_NEAR(ratios[0]["error"], rows[1]["error_mm"].get<double>() / rows[0]["error_mm"].get<double>(),
              1e-9);
  if (run_program("/usr/bin/python3", {"-c", "import matplotlib"}).exit_code != 0) return;
  const ProgramResult drawn = run_program(
      "/usr/bin/python3", {std::string(GELSLAM_SCRIPTS) + "/plot_ablation.py", set.folder / "study"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(read_bytes(set.folder / "study/ablation.png"), testing::StartsWith("\x89PNG"));
}

}  // namespace
}  // namespace gelslam
